"""Loops with delays to test with, and what is true of them by brute force."""

from itertools import pairwise

import numpy as np

from design.classical.controller import ClassicalController
from design.classical.tab_loop import tab_loop
from design.loop import Loop
from model.actuators import Actuator

#: What a tab actuator is commanded, and bandwidth and damping ratio of its servo.
DRIVES = {
    "second_order": ("deflection", 2.0 * np.pi * 40.0, 0.7),
    "first_order": ("deflection", 2.0 * np.pi * 40.0, None),
    "ideal": ("deflection", None, None),
    "rate": ("rate", None, None),
}


def loop(A, B, K, delay, E=None, N=None, C=None, F=None, D=None, H=None, G=None, M=None, offset=None):
    """A Loop over any grid; what is left out is zero."""
    A, B, K = (np.asarray(M, dtype=float) for M in (A, B, K))
    *grid, n, m = B.shape
    o = 0 if C is None else np.shape(C)[-2]
    q = 0 if G is None else np.shape(G)[-1]
    blank = {"E": (n, 1), "N": (m, 1), "C": (o, n), "F": (o, n), "D": (o, m), "H": (o, m), "G": (n, q), "M": (m, q)}
    given = {"E": E, "N": N, "C": C, "F": F, "D": D, "H": H, "G": G, "M": M}
    made = {k: np.zeros((*grid, *blank[k])) if v is None else np.asarray(v, dtype=float) for k, v in given.items()}
    return Loop(
        A=A, B=B, K=K, **made, offset=np.zeros((*grid, o)) if offset is None else offset,
        states=tuple(f"x{i}" for i in range(n)), inputs=("tab", "aileron")[:m], references=("r_a",),
        outputs=tuple(f"y{i}" for i in range(o)), disturbances=tuple(f"w{i}" for i in range(q)), stages=(), delay=delay,
    )  # fmt: skip


def scalar(a, delay):
    """``x' = -a x(t - delay)`` over the shape of a."""
    a = np.asarray(a, dtype=float)[..., None, None]
    return loop(np.zeros_like(a), np.ones_like(a), a, (delay,))


def random_loops(count, n, delay, seed, stable=True):
    """Random loops that are stable without their delays, or whose plants are."""
    rng = np.random.default_rng(seed)
    A = rng.standard_normal((count, n, n))
    A -= (np.linalg.eigvals(A).real.max(axis=-1) + rng.uniform(0.05, 1.0, count))[:, None, None] * np.eye(n)
    B = rng.standard_normal((count, n, len(delay)))
    K = rng.standard_normal((count, len(delay), n)) * rng.choice([0.1, 0.3, 1.0, 3.0], (count, 1, 1))
    return loop(A + B @ K if stable else A, B, K, delay)


def determinant(loop, s):
    """``det(sI - A + sum b_i k_i exp(-s delay_i))`` of one point at s (M,)."""
    x = np.exp(-s[:, None] * np.array(loop.delay))
    return np.linalg.det(s[:, None, None] * np.eye(loop.A.shape[-1]) - loop.A + (loop.B * x[:, None, :]) @ loop.K)


def winding(loop, corners, samples=5_000):
    """Zeros of the determinant inside a polygon, counted by its angle along dense samples."""
    corners = np.asarray([*corners, corners[0]], dtype=complex)
    fractions = np.linspace(0.0, 1.0, samples) ** 2
    total = 0.0
    for a, b in pairwise(corners):
        # Denser towards both ends of each side.
        half = 0.5 * fractions
        t = np.concatenate([half, 1.0 - half[::-1][1:]])
        angle = np.unwrap(np.angle(determinant(loop, a + (b - a) * t)))
        assert np.abs(np.diff(angle)).max() < 1.5
        total += angle[-1] - angle[0]
    count = total / (2.0 * np.pi)
    assert abs(count - round(count)) < 1e-6
    return round(count)


def full_loop(delay, seed=0, n=4, grid=()):
    """A random stable loop that uses every matrix."""
    rng = np.random.default_rng(seed)
    base = random_loops(int(np.prod(grid, dtype=int)), n, delay, seed)
    m = len(delay)

    def draw(*shape):
        return rng.standard_normal((*grid, *shape))

    return loop(
        base.A.reshape(*grid, n, n), base.B.reshape(*grid, n, m), 0.2 * base.K.reshape(*grid, m, n), delay,
        E=draw(n, 1), N=draw(m, 1), C=draw(3, n), F=draw(3, n), D=draw(3, m), H=draw(3, m), G=draw(n, 2), M=draw(m, 2),
        offset=draw(3),
    )  # fmt: skip


def tab_only(plant, drive, delay):
    """Negative feedback with gains low enough for 15 ms at all but the highest speed."""
    command, w, z = DRIVES[drive]
    gains = {"K_d": 0.005, "K_p": 0.2, "K_i": 10.0, **({"K_theta": 30.0} if command == "rate" else {})}
    controller = ClassicalController(
        "nf", "negative_feedback", rate_filter=2.0 * np.pi * 100.0, tab_command=command, gains=gains
    )
    actuator = Actuator(w, z, 2.0 * np.pi * 80.0, delay=delay)
    arrays = {k: np.full(plant.grid.shape, v) for k, v in gains.items()}
    return tab_loop(plant.model, plant.servo, actuator, controller, arrays)
