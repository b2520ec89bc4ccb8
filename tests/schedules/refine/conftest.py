"""Refined tables, and an independent look at any table at scattered points."""

from dataclasses import replace

import numpy as np
import pytest

from design.assess import achieved, assess
from design.classical.controller import ClassicalController
from design.classical.tab_loop import tab_loop
from design.lqr.flown import flown_loop
from design.lqr.synthesis import design_lqr
from design.lqr.torque_loop import lqr_loop
from design.outcome import Outcomes
from model.examples import airliner_aileron
from model.flight import flight_condition
from model.linear_model import INPUTS
from model.linearise import linearise
from model.servo_tab import servo_tab
from model.trim import trim
from schedules.analysis import analyse
from schedules.interpolate import interpolate
from schedules.judging import horizon
from schedules.refine.refine import refine
from schedules.refine.request import RefineRequest
from schedules.schedule import Provenance
from schedules.schedule_of import schedule_of
from schedules.study import GridRequest

NOWHERE = Provenance(design_id="", design_name="", request_digest="", version="", created_at="")


@pytest.fixture(scope="session")
def airliner_study(wind_tunnel_study):
    """The full-scale aileron with its own weights: compressible, so that altitude matters."""
    system, lqr = airliner_aileron(), wind_tunnel_study.controllers[2]
    weights = replace(
        lqr.weights, aileron_rate=np.deg2rad(60.0), tab_rate=np.deg2rad(150.0), aileron_integral=np.deg2rad(0.5),
        tab_torque=100.0, aileron_torque=1500.0,
    )  # fmt: skip
    return replace(
        wind_tunnel_study, geometry=system.geometry, inertia=system.inertia, aerodynamics=system.aerodynamics,
        grid=GridRequest((0.0, 9000.0), "dynamic_pressure", (3000.0, 12000.0)),
        reference=replace(wind_tunnel_study.reference, duration=3.0), controllers=(replace(lqr, weights=weights),),
    )  # fmt: skip


@pytest.fixture(scope="session")
def refined(wind_tunnel_study, airliner_study):
    """The examples' controllers, proved at nine tenths of the slowest pole's rate."""
    wanted = RefineRequest(fraction=0.9)
    found = {name: refine(wind_tunnel_study, name, wanted) for name in ("lqr", "nf", "pf")}
    return {**found, "airliner": refine(airliner_study, "lqr", wanted)}


@pytest.fixture(scope="session")
def scattered():
    """Random points (N,) of a study's envelope: altitude and speed."""

    def points(study, count=2000, seed=0):
        rng, grid = np.random.default_rng(seed), study.grid
        return tuple(rng.uniform(axis[0], axis[-1], count) for axis in (grid.altitude, grid.speed))

    return points


@pytest.fixture(scope="session")
def largest_loss():
    """The largest loss of a designed table's specs at scattered points, as parts of their limits, by quantity.

    A state feedback is held against the designs that the points themselves would have, too.
    """

    def losses(envelope, points):
        study, designed = envelope.study, envelope.controllers[0]
        request, model = designed.request, _models(study, points)
        step, duration = study.reference.sizes(designed.loop.references), horizon(study, request)
        flown = assess(_loops(study, envelope, model, points), step, duration)
        specs = request.specs if isinstance(request, ClassicalController) else study.spec_pack
        found = {spec.quantity: np.max(-spec.distance(achieved(flown, spec.quantity)) / spec.scale) for spec in specs}
        if not isinstance(request, ClassicalController):
            outcomes = Outcomes.all_ok((len(points[0]),))
            made = design_lqr(model, request, outcomes, study.tab_actuator, study.aileron_actuator)
            own = assess(lqr_loop(model, made), step, duration)
            found["own damping_ratio"] = np.max(1.0 - flown.damping_ratio / own.damping_ratio)
            found["own settling_time"] = np.max(flown.step.settling_time / own.step.settling_time - 1.0)
        return found

    return losses


def _models(study, points):
    altitude, speed = points
    plant = analyse(study)
    condition = flight_condition(altitude, study.grid.speed_axis, speed, study.grid.temperature_offset)
    return linearise(plant.system, condition, trim(plant.system, condition, study.trim))


def _loops(study, envelope, model, points):
    designed = envelope.controllers[0]
    read = interpolate(schedule_of(envelope, designed, NOWHERE), points)
    gains = {gain.name: gain.values for gain in read.gains}
    if isinstance(designed.request, ClassicalController):
        return tab_loop(model, servo_tab(model), study.tab_actuator, designed.request, gains)
    structure = designed.request.structure(study.tab_actuator, study.aileron_actuator)
    names = structure.states(model.states)
    K = np.stack([np.stack([gains[f"K_{u}_{x}"] for x in names], axis=-1) for u in INPUTS], axis=-2)
    N = np.stack([np.stack([gains[f"N_{u}_{r}"] for r in structure.references], axis=-1) for u in INPUTS], axis=-2)
    return flown_loop(model, structure, K, N)
