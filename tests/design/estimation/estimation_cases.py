"""Full-state feedback loops of the wind-tunnel example in every structure, hand-made ones, and a noise model."""

from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import numpy as np

from design.estimation.noise_model import NoiseModel
from design.loop import Loop
from design.lqr.synthesis import LqrController, design_lqr
from design.lqr.torque_loop import lqr_loop
from model.actuators import Actuator
from model.examples import WIND_TUNNEL_TRIM, wind_tunnel
from model.linearise import linearise
from model.trim import trim
from tests.design.lqr_cases import TUNNEL_GRID, WIND_TUNNEL_WEIGHTS

DEGREE = np.pi / 180.0
#: Encoders of 0.02 degree read a thousand times a second, and a torque noise that moves the surfaces by more than that.
NOISE = NoiseModel(1e-5, 1e-3, (0.02 * DEGREE) ** 2 * 1e-3, (0.02 * DEGREE) ** 2 * 1e-3)
LAGGED = Actuator(torque_loop_bandwidth=420.0), Actuator(torque_loop_bandwidth=340.0)
LATE = Actuator(delay=0.002), Actuator(delay=0.003)
CASES = {
    "ideal": {},
    "regulator": {"reference": "none"},
    "lagged": {"reference": "aileron_and_tab", "drives": LAGGED},
    "unsteady": {"unsteady": True, "drives": LAGGED},
    "modelled_delay": {
        "drives": (Actuator(torque_loop_bandwidth=420.0, delay=0.003), Actuator(delay=0.003)), "delay_states": 3,
    },
    "late": {"drives": LATE},
}  # fmt: skip
#: Those without a transport delay, where separation is exact.
PROMPT = ("ideal", "regulator", "lagged", "unsteady")
WEIGHTS = replace(WIND_TUNNEL_WEIGHTS, tab_integral=0.01)


@cache
def plant(unsteady=False):
    system = wind_tunnel()
    if unsteady:
        system = replace(system, aerodynamics=replace(system.aerodynamics, damping="unsteady", virtual_inertia=True))
    model = linearise(system, TUNNEL_GRID.condition, trim(system, TUNNEL_GRID.condition, WIND_TUNNEL_TRIM))
    return SimpleNamespace(system=system, model=model, condition=TUNNEL_GRID.condition)


@cache
def full_state(name) -> Loop:
    """The loop of a case over the grid of 2 x 4."""
    case = {"reference": "aileron", "drives": (Actuator(), Actuator()), "delay_states": 0, "unsteady": False}
    case |= CASES[name]
    asked = LqrController("lqr", WEIGHTS, reference=case["reference"], delay_states=case["delay_states"])
    model = plant(case["unsteady"]).model
    design = design_lqr(model, asked, None, *case["drives"])
    assert design.outcomes.ok.all()
    return lqr_loop(model, design)


def made_loop(A, B, K) -> Loop:
    """A full-state loop of given matrices (*G, n, n), (*G, n, 2), (*G, 2, n): torques enter as the commands do.

    The states are ``dt dt_rate da da_rate``, then ``other_1 ..``.
    """
    *grid, n, _ = A.shape
    states = ("dt", "dt_rate", "da", "da_rate", *(f"other_{k + 1}" for k in range(n - 4)))
    noises = ("dt_noise", "dt_rate_noise", "da_noise", "da_rate_noise")
    G, M = np.zeros((*grid, n, 6)), np.zeros((*grid, 2, 6))
    G[..., :2], M[..., 2:] = B, -K[..., :4]
    C = np.zeros((*grid, 2, n))
    C[..., 0, 2] = C[..., 1, 0] = 1.0
    nothing = np.zeros((*grid, 2, 2))
    return Loop(
        A=A, B=B, E=np.zeros((*grid, n, 0)), G=G, K=K, N=np.zeros((*grid, 2, 0)), M=M, C=C, F=np.zeros_like(C),
        D=nothing, H=nothing, offset=np.zeros((*grid, 2)), states=states, inputs=("tab", "aileron"), references=(),
        outputs=("da", "dt"), disturbances=("T_t_disturbance", "T_a_disturbance", *noises), stages=(),
        delay=(0.0, 0.0),
    )  # fmt: skip


def double_integrators(inertia=(2.0, 5.0)) -> Loop:
    """Two inertias that nothing couples, each held by a spring and a damper of its own."""
    A, B, K = np.zeros((4, 4)), np.zeros((4, 2)), np.zeros((2, 4))
    A[0, 1] = A[2, 3] = 1.0
    B[1, 0], B[3, 1] = 1.0 / inertia[0], 1.0 / inertia[1]
    K[0, :2], K[1, 2:] = (9.0, 4.0), (16.0, 6.0)
    return made_loop(A, B, K)


FIELDS = ("A", "B", "E", "G", "K", "N", "M", "C", "F", "D", "H", "offset")


def same_numbers(one: Loop, other: Loop, tolerance=1e-12):
    """The two loops have the same names and numbers."""
    for name in ("states", "inputs", "references", "outputs", "disturbances", "delay"):
        assert getattr(one, name) == getattr(other, name)
    for name in FIELDS:
        ours, theirs = getattr(one, name), getattr(other, name)
        np.testing.assert_allclose(ours, theirs, rtol=tolerance, atol=tolerance * np.max(np.abs(theirs), initial=0.0))
    for stage, theirs in zip(one.stages, other.stages, strict=True):
        np.testing.assert_allclose(stage.closed(), theirs.closed(), rtol=1e-9, atol=1e-9 * np.abs(stage.A).max())


def open_response(loop, s, command="B"):
    """``K (sI - A)^-1 B`` of one point at s (...), or from another input matrix, (..., m, k)."""
    pencil = np.asarray(s)[..., None, None] * np.eye(len(loop.states)) - loop.A
    drive = getattr(loop, command).astype(complex)
    return loop.K @ np.linalg.solve(pencil, np.broadcast_to(drive, (*pencil.shape[:-1], drive.shape[-1])))


def with_holes(loop):
    """The loop with nan at two of its points, and the mask of those that are left."""
    mask = np.ones((2, 4), dtype=bool)
    mask[0, 1] = mask[1, 3] = False
    return loop.take(mask).spread(mask), mask
