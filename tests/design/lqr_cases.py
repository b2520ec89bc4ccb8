"""The shipped examples with their grids and LQR weights, and problems that are hard on purpose."""

from dataclasses import dataclass

import numpy as np

from design.lqr.synthesis import LqrController
from design.lqr.weights import BrysonWeights
from model.arrays import FloatArray
from model.examples import (
    AIRLINER_TRIM,
    WIND_TUNNEL_TRIM,
    airliner_aileron,
    wind_tunnel,
    wind_tunnel_23012,
)
from model.flight import flight_grid
from model.linear_model import LinearModel
from model.linearise import linearise
from model.trim import trim

_DEGREE = np.pi / 180.0
WIND_TUNNEL_WEIGHTS = BrysonWeights(
    aileron=2.0 * _DEGREE,
    aileron_rate=200.0 * _DEGREE,
    tab=10.0 * _DEGREE,
    tab_rate=400.0 * _DEGREE,
    aileron_integral=0.1 * _DEGREE,
    tab_torque=0.5,
    aileron_torque=2.0,
)
AIRLINER_WEIGHTS = BrysonWeights(
    aileron=2.0 * _DEGREE,
    aileron_rate=60.0 * _DEGREE,
    tab=10.0 * _DEGREE,
    tab_rate=150.0 * _DEGREE,
    aileron_integral=0.5 * _DEGREE,
    tab_torque=100.0,
    aileron_torque=1500.0,
)
TUNNEL_GRID = flight_grid(np.array([0.0, 3000.0]), "dynamic_pressure", np.array([245.0, 551.25, 980.0, 1531.25]))
AIRLINER_GRID = flight_grid(
    np.array([0.0, 3000.0, 6000.0, 9000.0]), "dynamic_pressure", np.linspace(3000.0, 12000.0, 7)
)
EXAMPLES = {
    "wind_tunnel": (wind_tunnel(), TUNNEL_GRID, WIND_TUNNEL_TRIM, WIND_TUNNEL_WEIGHTS),
    "wind_tunnel_23012": (wind_tunnel_23012(), TUNNEL_GRID, WIND_TUNNEL_TRIM, WIND_TUNNEL_WEIGHTS),
    "airliner_aileron": (airliner_aileron(), AIRLINER_GRID, AIRLINER_TRIM, AIRLINER_WEIGHTS),
}


def example(name: str) -> tuple[LinearModel, LqrController]:
    system, grid, request, weights = EXAMPLES[name]
    model = linearise(system, grid.condition, trim(system, grid.condition, request))
    return model, LqrController("lqr", weights)


@dataclass(frozen=True)
class Problems:
    """Regulator problems over N points."""

    A: FloatArray
    B: FloatArray
    Q: FloatArray
    R: FloatArray

    def __len__(self) -> int:
        return len(self.A)


def tunnel_plant() -> tuple[FloatArray, FloatArray]:
    """Data set A with its integrator at one point, (5, 5) and (5, 2)."""
    model = example("wind_tunnel")[0].take((0, 3))
    A, B = np.zeros((5, 5)), np.zeros((5, 2))
    A[:4, :4], B[:4], A[4, 2] = model.A, model.B, -1.0
    return A, B


def weights_over_twelve_decades(points: int, seed: int) -> Problems:
    """The tunnel plant, every diagonal weight log-uniform in 1e-6 .. 1e6."""
    random = np.random.default_rng(seed)
    A, B = tunnel_plant()
    Q = [np.diag(10.0 ** random.uniform(-6, 6, 5)) for _ in range(points)]
    R = [np.diag(10.0 ** random.uniform(-6, 6, 2)) for _ in range(points)]
    return Problems(np.tile(A, (points, 1, 1)), np.tile(B, (points, 1, 1)), np.array(Q), np.array(R))


def hidden_modes(points: int, seed: int) -> Problems:
    """Random plants with a mode on the axis that the cost sees ever less: by a factor of 1e-3 .. 1e-17."""
    random = np.random.default_rng(seed)
    A, B, Q = np.zeros((points, 5, 5)), np.zeros((points, 5, 2)), np.zeros((points, 5, 5))
    for i in range(points):
        modes = 1 + int(random.random() < 0.5)
        block = np.zeros((5, 5))
        if modes == 2:
            block[0, 1] = 10.0 ** random.uniform(-1, 1)
            block[1, 0] = -block[0, 1]
        block[modes:, modes:] = random.normal(size=(5 - modes, 5 - modes))
        C = random.normal(size=(3, 5))
        C[:, :modes] *= 10.0 ** random.uniform(-17, -3)
        T = np.linalg.qr(random.normal(size=(5, 5)))[0] if random.random() < 0.7 else np.eye(5)
        A[i], B[i], seen = T @ block @ T.T, T @ random.normal(size=(5, 2)), C @ T.T
        Q[i] = seen.T @ seen
    return Problems(A, B, 0.5 * (Q + Q.mT), np.tile(np.eye(2), (points, 1, 1)))


def unreached_modes(points: int, seed: int) -> Problems:
    """Random plants with an unstable mode that the inputs reach ever less: by a factor of 1e-1 .. 1e-17."""
    random = np.random.default_rng(seed)
    A, B, Q = np.zeros((points, 5, 5)), np.zeros((points, 5, 2)), np.zeros((points, 5, 5))
    for i in range(points):
        block = np.zeros((5, 5))
        block[0, 0] = abs(random.normal())
        block[1:, 1:] = random.normal(size=(4, 4))
        inputs = random.normal(size=(5, 2))
        inputs[0] *= 10.0 ** random.uniform(-17, -1)
        T = np.linalg.qr(random.normal(size=(5, 5)))[0] if random.random() < 0.7 else np.eye(5)
        C = random.normal(size=(5, 5))
        A[i], B[i], Q[i] = T @ block @ T.T, T @ inputs, C @ C.T
    return Problems(A, B, Q, np.tile(np.eye(2), (points, 1, 1)))


def hidden_discrete_modes(points: int, seed: int) -> Problems:
    """The same from sample to sample: a mode at 1, -1 or elsewhere on the unit circle that Q sees ever less."""
    random = np.random.default_rng(seed)
    A, B, Q = np.zeros((points, 5, 5)), np.zeros((points, 5, 2)), np.zeros((points, 5, 5))
    for i in range(points):
        block = np.zeros((5, 5))
        if i % 3 == 2:
            angle = random.uniform(0.01, 3.1)
            block[:2, :2] = [[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]]
        else:
            block[0, 0] = 1.0 - 2.0 * (i % 3)
        modes = 2 if i % 3 == 2 else 1
        block[modes:, modes:] = 0.6 * random.normal(size=(5 - modes, 5 - modes))
        C = random.normal(size=(3, 5))
        C[:, :modes] *= 10.0 ** random.uniform(-17, -3)
        T = np.linalg.qr(random.normal(size=(5, 5)))[0] if random.random() < 0.7 else np.eye(5)
        A[i], B[i], seen = T @ block @ T.T, T @ random.normal(size=(5, 2)), C @ T.T
        Q[i] = seen.T @ seen
    return Problems(A, B, 0.5 * (Q + Q.mT), np.tile(np.eye(2), (points, 1, 1)))


def unreached_discrete_modes(points: int, seed: int) -> Problems:
    """The same from sample to sample: an unstable mode that the inputs reach ever less."""
    random = np.random.default_rng(seed)
    A, B, Q = np.zeros((points, 5, 5)), np.zeros((points, 5, 2)), np.zeros((points, 5, 5))
    for i in range(points):
        block = np.zeros((5, 5))
        block[0, 0] = 1.0 + abs(random.normal())
        block[1:, 1:] = 0.6 * random.normal(size=(4, 4))
        inputs = random.normal(size=(5, 2))
        inputs[0] *= 10.0 ** random.uniform(-17, -1)
        T = np.linalg.qr(random.normal(size=(5, 5)))[0] if random.random() < 0.7 else np.eye(5)
        C = random.normal(size=(5, 5))
        A[i], B[i], Q[i] = T @ block @ T.T, T @ inputs, C @ C.T
    return Problems(A, B, Q, np.tile(np.eye(2), (points, 1, 1)))
