"""Noise through the sampled closed loop, seeded: errors of the estimate and commands as large as the filter says."""

import numpy as np
import pytest
import scipy.linalg

from design.estimation.kalman_filter import kalman_filter
from design.estimation.loss import estimation_loss
from design.estimation.observer import with_kalman_filter
from tests.design.estimation.estimation_cases import NOISE, full_state

INDEX = (1, 2)
STEP, PATHS, STEPS, SETTLED = 5e-4, 1200, 700, 300


def _sampled_noise(A, drive, intensity):
    """``x(t + h) = E x(t) + e``: E, and a root of the covariance of e (Van Loan 1978)."""
    n = len(A)
    block = np.block([[-A, drive @ intensity @ drive.T], [np.zeros((n, n)), A.T]]) * STEP
    made = scipy.linalg.expm(block)
    step = made[n:, n:].T
    covariance = step @ made[:n, n:]
    values, vectors = np.linalg.eigh(0.5 * (covariance + covariance.T))
    return step, vectors * np.sqrt(np.maximum(values, 0.0))


@pytest.mark.parametrize("name", ["ideal", "unsteady"])
def test_errors_and_commands_under_noise(name):
    loop = full_state(name)
    found = kalman_filter(loop, NOISE)
    made = with_kalman_filter(loop, found).take(INDEX)
    figures = estimation_loss(loop, with_kalman_filter(loop, found), NOISE, np.array([0.1]), 0.8).implemented
    intensity = np.diag([NOISE.tab_torque, NOISE.aileron_torque, NOISE.tab_angle, NOISE.aileron_angle])
    step, root = _sampled_noise(made.closed, made.disturbance_input, intensity)
    rng = np.random.default_rng(7)
    rows = [loop.states.index(state) for state in found.states[:4]]
    seen = np.concatenate([np.eye(len(made.states))[rows], np.zeros((2, len(made.states)))])
    seen[range(4), [made.states.index(f"est_{state}") for state in found.states[:4]]] = -1.0
    seen[4:] = -made.K
    x, total, count = np.zeros((len(made.states), PATHS)), np.zeros((6, 6)), 0
    for k in range(STEPS):
        x = step @ x + root @ rng.standard_normal(x.shape)
        if k >= SETTLED and k % 10 == 0:
            signals = seen @ x
            total += signals @ signals.T
            count += PATHS
    spread = total / count
    scale = found.error_rms[INDEX][:4]
    # 48000 samples: a variance is known to 0.7 %, an entry of a correlation to 0.5 % of the scale.
    np.testing.assert_allclose(
        spread[:4, :4] / np.outer(scale, scale), found.P[INDEX][:4, :4] / np.outer(scale, scale), atol=0.03
    )
    commands = np.hypot(figures.noise_rms[INDEX], figures.disturbance_rms[INDEX])[2:]
    np.testing.assert_allclose(np.sqrt(np.diag(spread)[4:]), commands, rtol=0.03)
