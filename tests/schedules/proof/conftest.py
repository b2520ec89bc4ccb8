"""Designs to be proved, and the loops of a schedule anywhere in the envelope, made without the code under test."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import linprog

from design.classical.controller import ClassicalController
from design.classical.tab_loop import tab_loop
from design.estimation.rate_filters import with_rate_filters
from design.lqr.controller import LqrController
from design.lqr.flown import flown_loop
from design.lqr.measurement import RateFilters
from design.outcome import Outcomes
from model.examples import airliner_aileron, wind_tunnel_23012
from model.flight import flight_condition
from model.linear_model import INPUTS
from model.linearise import linearise
from model.servo_tab import servo_tab
from model.trim import trim
from schedules.designed import DesignedController
from schedules.interpolate import interpolate
from schedules.run import run
from schedules.schedule import GainSchedule, Provenance
from schedules.study import GridRequest

NOWHERE = Provenance(design_id="", design_name="", request_digest="", version="", created_at="")


@pytest.fixture(scope="session")
def envelope_of(wind_tunnel_study):
    """Builder of designed envelopes: parts of the wind-tunnel study replaced."""

    def make(system=None, **changes):
        parts = (
            {} if system is None else {name: getattr(system, name) for name in ("geometry", "inertia", "aerodynamics")}
        )
        study = replace(wind_tunnel_study, **{**parts, **changes})
        return study, run(study)

    return make


@pytest.fixture(scope="session")
def example_a(wind_tunnel_study, wind_tunnel_envelope):
    return wind_tunnel_study, wind_tunnel_envelope


@pytest.fixture(scope="session")
def example_b(envelope_of):
    return envelope_of(wind_tunnel_23012())


@pytest.fixture(scope="session")
def only_lqr(wind_tunnel_study):
    return wind_tunnel_study.controllers[2:]


@pytest.fixture(scope="session")
def airliner(envelope_of, only_lqr):
    """Quasi-steady damping with compressibility: altitude, dynamic pressure and Mach number all matter."""
    weights = replace(only_lqr[0].weights, tab_torque=100.0, aileron_torque=1500.0, aileron_integral=0.5)
    grid = GridRequest((0.0, 6000.0, 12500.0), "dynamic_pressure", (3000.0, 6000.0, 9000.0))
    return envelope_of(airliner_aileron(), controllers=(replace(only_lqr[0], weights=weights),), grid=grid)


@pytest.fixture(scope="session")
def loops_at():
    """Closed loops of a schedule (N, n, n) at altitudes and speeds (N,), by trim, linearisation and interpolation."""

    def loops(study, envelope, designed, altitude, speed, read=None):
        plant, request = envelope.plant, designed.request
        condition = flight_condition(altitude, study.grid.speed_axis, speed, study.grid.temperature_offset)
        model = linearise(plant.system, condition, trim(plant.system, condition, study.trim))
        schedule = GainSchedule("", request.kind, plant.grid.axes, designed.gains, designed.outcomes, "", NOWHERE)
        found = interpolate(schedule, (altitude, speed if read is None else read))
        gains = {gain.name: gain.values for gain in found.gains}
        if isinstance(request, ClassicalController):
            return tab_loop(model, servo_tab(model), study.tab_actuator, request, gains).closed
        structure = request.structure(study.tab_actuator, study.aileron_actuator)
        names = structure.states(model.states)
        K = np.stack([np.stack([gains[f"K_{u}_{x}"] for x in names], axis=-1) for u in INPUTS], axis=-2)
        N = np.stack([np.stack([gains[f"N_{u}_{r}"] for r in structure.references], axis=-1) for u in INPUTS], axis=-2)
        loop = flown_loop(model, structure, K, N)
        if isinstance(request.measurement, RateFilters):
            loop = with_rate_filters(loop, request.measurement.cutoff)
        return loop.closed

    return loops


@pytest.fixture(scope="session")
def with_gains():
    """A designed controller with other gains, by name (nh, ns), its loop assembled anew; nothing is judged."""

    def change(study, envelope, designed, tables):
        plant, request = envelope.plant, designed.request
        gains = tuple(
            replace(gain, values=np.asarray(tables.get(gain.name, gain.values), float)) for gain in designed.gains
        )
        values = {gain.name: gain.values for gain in gains}
        outcomes = Outcomes.all_ok(designed.outcomes.ok.shape)
        if isinstance(request, ClassicalController):
            loop = tab_loop(plant.model, plant.servo_tab, study.tab_actuator, request, values)
        else:
            assert isinstance(request, LqrController)
            K = np.stack(
                [np.stack([values[f"K_{u}_{x}"] for x in designed.loop.states], axis=-1) for u in INPUTS], axis=-2
            )
            structure = request.structure(study.tab_actuator, study.aileron_actuator)
            loop = flown_loop(plant.model, structure, K, designed.loop.N)
        none = np.full(outcomes.ok.shape, np.nan)
        return DesignedController(request, outcomes, gains, loop, None, none.astype(complex), none, ())

    return change


@pytest.fixture(scope="session")
def in_hull():
    """Whether a loop is a mixture of others, by linear programming."""

    def held(points, target):
        flat = points.reshape(len(points), -1)
        size = np.maximum(np.max(np.abs(flat), axis=0), 1e-30)
        used = np.max(np.abs(flat), axis=0) > 0.0
        equations = np.vstack([(flat / size)[:, used].T, np.ones(len(flat))])
        right = np.append((target.ravel() / size)[used], 1.0)
        slack = 1e-7
        found = linprog(
            np.zeros(len(flat)),
            A_ub=np.vstack([equations, -equations]),
            b_ub=np.concatenate([right + slack, slack - right]),
        )
        return found.status == 0

    return held
