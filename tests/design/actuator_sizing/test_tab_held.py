"""The aileron's torque with the tab held: inverse dynamics of the non-linear model, and statics."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from design.actuator_sizing.tab_held import TAB_HELD, with_tab_held
from design.lqr.synthesis import design_lqr
from design.lqr.torque_loop import lqr_loop
from design.manoeuvre import doublet, step
from design.response.manoeuvre_response import manoeuvre_response
from model.arrays import FloatArray
from model.motion import required_torque
from schedules.analysis import PlantEnvelope, analyse
from schedules.run import run
from schedules.study import Study
from schedules.tab_saving import tab_saving


def responses(study: Study, plant: PlantEnvelope, size: float) -> tuple[FloatArray, FloatArray]:
    """Torques with the tab held (*G, T): as an output, and by inverse dynamics of the motion that the loop flies."""
    controller = study.controllers[2]
    loop = with_tab_held(lqr_loop(plant.model, design_lqr(plant.model, controller)), plant.model)
    found = manoeuvre_response(loop, doublet(np.array([size]), 0.15), 0.6, 241)
    da, da_rate = (found.states[..., loop.states.index(name)] for name in ("da", "da_rate"))
    row = loop.states.index("da_rate")
    acceleration = (found.states @ loop.closed[..., row, :, None])[..., 0]
    acceleration += (found.references @ loop.reference_input[..., row, :, None])[..., 0]
    n = plant.model.A.shape[-1]
    # Lag states are those of the aileron's motion from the trim, where they have settled.
    state = np.zeros((*da.shape, n)) + plant.model.state_offset[..., None, :]
    state[..., 2] += da
    state[..., 3] += da_rate
    for i, name in enumerate(plant.model.states[4:]):
        state[..., 4 + i] += found.states[..., loop.states.index(f"{name}_tab_held")]
    accelerations = np.stack([0.0 * acceleration, acceleration], axis=-1)
    wanted = np.empty_like(da)
    for index in np.ndindex(da.shape[:-1]):
        alpha = plant.trim.alpha[index]
        wanted[index] = required_torque(
            plant.system, plant.grid.condition.take(index), alpha, state[index], accelerations[index]
        )[..., 1]
    return found.outputs[..., found.index(TAB_HELD)], wanted


@pytest.mark.parametrize("damping", ["thesis", "quasi_steady", "unsteady"])
def test_it_is_the_inverse_dynamics_of_the_same_motion(wind_tunnel_study: Study, damping: str) -> None:
    """The difference is of the second order of the size."""
    study = replace(wind_tunnel_study, aerodynamics=replace(wind_tunnel_study.aerodynamics, damping=damping))
    plant, errors = analyse(study), []
    for size in (2e-3, 1e-3):
        ours, wanted = responses(study, plant, size)
        errors.append(np.max(np.abs(ours - wanted)) / np.max(np.abs(wanted - wanted[..., :1])))
    assert errors[0] < 1e-3
    assert errors[1] < 0.6 * errors[0] or errors[1] < 1e-9


def test_at_rest_it_is_the_static_hinge_moment(wind_tunnel_study: Study) -> None:
    plant, size = analyse(wind_tunnel_study), np.deg2rad(10.0)
    loop = with_tab_held(lqr_loop(plant.model, design_lqr(plant.model, wind_tunnel_study.controllers[2])), plant.model)
    found = manoeuvre_response(loop, step(np.array([size])), 1.0)
    A, B = plant.model.A, plant.model.B
    # Torques that hold dt = 0, da = size: 0 = A x + B u in the rows of the rates.
    held = -np.linalg.solve(B[..., [1, 3], :], A[..., [1, 3], 2:3] * size)[..., 1, 0]
    wanted = plant.model.input_offset[..., 1] + held
    np.testing.assert_allclose(found.final_outputs[..., found.index(TAB_HELD)], wanted, rtol=1e-9)


def test_the_tab_saves_torque_where_it_is_said_to(wind_tunnel_study: Study) -> None:
    envelope = run(wind_tunnel_study)
    manoeuvre, G = step(np.array([np.deg2rad(10.0)])), envelope.plant.grid.shape
    saving = {c.request.name: tab_saving(envelope.plant, c, manoeuvre, 1.0) for c in envelope.controllers}
    lqr = saving["lqr"]
    assert lqr.peak_torque.shape == G
    np.testing.assert_allclose(lqr.peak_torque, envelope.controller("lqr").assessment.demand[1].peak_torque, rtol=1e-7)
    # At rest the tab takes all of it (`zero_aileron_torque`): what is left is to accelerate.
    assert np.all(lqr.saved[:, -1] > 0.1)
    ratio = 1.0 - np.max(lqr.peak_torque) / np.max(lqr.tab_held)
    assert lqr.saved_of_the_envelope == pytest.approx(ratio)
    for name in ("nf", "pf"):
        trim = np.abs(envelope.plant.model.input_offset[..., 1])
        np.testing.assert_allclose(saving[name].peak_torque, trim)
        assert np.all(saving[name].tab_held > trim)
    nowhere = replace(
        envelope.controller("lqr"),
        outcomes=envelope.plant.outcomes.failing(np.ones(G, dtype=bool), "infeasible", lambda index: "none"),
    )
    assert tab_saving(envelope.plant, nowhere, manoeuvre, 1.0).saved_of_the_envelope is None
