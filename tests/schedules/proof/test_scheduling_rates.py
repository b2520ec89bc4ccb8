"""Lyapunov matrices that move with the flight point, and the rates they are proved for."""

from dataclasses import replace
from math import comb

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from schedules.proof.flight_box import Box
from schedules.proof.moving_matrix import MovingCell, forms
from schedules.proof.prove import ProofRequest, prove
from schedules.proof.scheduling_rates import scheduling_rates

CLIMB = 50.0


@pytest.fixture(scope="module")
def proofs(example_a):
    study, envelope = example_a
    return {name: prove(study, envelope.plant, envelope.controller(name)) for name in ("nf", "pf", "lqr")}


@pytest.fixture(scope="module")
def rates(proofs):
    return {name: scheduling_rates(proofs[name], CLIMB) for name in ("nf", "pf")}


def bilinear(values, u, v):
    """Of values (2, 2, ...) at fractions (N,)."""
    weights = np.stack([np.stack([(1 - u) * (1 - v), (1 - u) * v]), np.stack([u * (1 - v), u * v])])
    return np.einsum("abn,abij->nij", weights, values)


def matrix_at(found, altitude, speed):
    """P and its derivatives by altitude and speed (N, n, n)."""
    i = np.clip(np.searchsorted(found.altitude, altitude, side="right") - 1, 0, len(found.altitude) - 2)
    j = np.clip(np.searchsorted(found.speed, speed, side="right") - 1, 0, len(found.speed) - 2)
    dh, ds = np.diff(found.altitude)[i], np.diff(found.speed)[j]
    u, v = (altitude - found.altitude[i]) / dh, (speed - found.speed[j]) / ds
    corner = [[found.P[i + a, j + b] for b in (0, 1)] for a in (0, 1)]
    u, v, dh, ds = (x[:, None, None] for x in (u, v, dh, ds))
    P = (1 - u) * ((1 - v) * corner[0][0] + v * corner[0][1]) + u * ((1 - v) * corner[1][0] + v * corner[1][1])
    by_h = ((1 - v) * (corner[1][0] - corner[0][0]) + v * (corner[1][1] - corner[0][1])) / dh
    by_s = ((1 - u) * (corner[0][1] - corner[0][0]) + u * (corner[1][1] - corner[1][0])) / ds
    return P, by_h, by_s


@pytest.mark.parametrize("name", ["nf", "pf"])
def test_nothing_within_the_rates_contradicts_the_proof(rates, example_a, loops_at, name):
    study, envelope = example_a
    found, rng = rates[name], np.random.default_rng(3)
    assert found.altitude_rate == CLIMB
    assert found.speed_rate > 100.0
    h, s = rng.uniform(0.0, 3000.0, 20000), rng.uniform(245.0, 1531.25, 20000)
    A = loops_at(study, envelope, envelope.controller(name), h, s)
    P, by_h, by_s = matrix_at(found, h, s)
    assert np.min(np.linalg.eigvalsh(P)[:, 0]) > 0.0
    L = np.linalg.inv(np.linalg.cholesky(P))
    for up, fast in ((1, 1), (1, -1), (-1, 1), (-1, -1), (0.3, -0.7)):
        form = np.swapaxes(A, -1, -2) @ P + P @ A + up * CLIMB * by_h + fast * found.speed_rate * by_s
        assert np.max(np.linalg.eigvalsh(L @ form @ np.swapaxes(L, -1, -2))[:, -1]) < 0.0


def test_a_course_flown_at_the_rate_decays(rates, example_a, loops_at):
    """The speed swings through the envelope as fast as is proved, and the simulated loop loses energy all the way."""
    study, envelope = example_a
    found, designed = rates["pf"], envelope.controller("pf")
    span, period = 1531.25 - 245.0, 2.0 * (1531.25 - 245.0) / found.speed_rate

    def flown(t):
        part = np.abs((t / period) % 1.0 * 2.0 - 1.0)
        return 1000.0 + 20.0 * np.sin(t), 245.0 + part * span

    def motion(t, x):
        h, s = flown(t)
        return loops_at(study, envelope, designed, np.array([h]), np.array([s]))[0] @ x

    times = np.linspace(0.0, 3.0 * period, 40)
    x = solve_ivp(
        motion, (0.0, times[-1]), [0.1, 0.0, 0.1, 1.0, 0.01], t_eval=times, rtol=1e-7, atol=1e-12, max_step=period / 40
    )
    energies = []
    for t, state in zip(times, x.y.T, strict=True):
        P = matrix_at(found, *(np.array([value]) for value in flown(t)))[0][0]
        energies.append(state @ P @ state)
    assert np.all(np.diff(energies) < 0.0)


def test_one_matrix_for_the_envelope_allows_any_rate(proofs):
    found = scheduling_rates(proofs["lqr"], CLIMB)
    assert found.speed_rate == np.inf
    assert np.array_equal(found.P[1, 2], proofs["lqr"].common)


def test_a_loop_that_must_decay_faster_is_proved_for_slower_motion(proofs, rates):
    assert scheduling_rates(proofs["pf"], CLIMB, decay=2.0).speed_rate < rates["pf"].speed_rate


def test_a_schedule_that_is_not_stable_is_proved_for_no_rate(example_a, with_gains):
    study, envelope = example_a
    tables = {gain.name: gain.values.copy() for gain in envelope.controller("pf").gains}
    tables["K_f"][1, 1] *= 3.0
    bad = with_gains(study, envelope, envelope.controller("pf"), tables)
    proof = prove(study, envelope.plant, bad, ProofRequest(most_pieces=1))
    assert scheduling_rates(proof, 0.0).speed_rate == 0.0


@pytest.mark.parametrize("degrees", [(1, 1), (0, 1), (1, 2), (2, 2), (1, 0)])
def test_coefficients_are_those_of_the_polynomial(degrees):
    """Bernstein sums of the coefficients are M itself, made from the interpolated loop and matrix at random points."""
    rng = np.random.default_rng(0)
    m, k = degrees
    loops = rng.standard_normal((m + 1, k + 1, 1, 3, 3))
    corners = (1 if m == 0 else 2, 1 if k == 0 else 2)
    half = rng.standard_normal((*corners, 3, 3))
    P = half + np.swapaxes(half, -1, -2)
    box = Box((0.0, 1500.0 if m else 0.0), (200.0, 700.0 if k else 200.0))
    cell = MovingCell(np.arange(corners[0] * corners[1]).reshape(corners), box, loops)
    found = forms(cell.coefficients(3.0, 40.0, 0.7), P)
    top = m + corners[0] - 1, k + corners[1] - 1
    signs = [(a, b) for a in (-1.0, 1.0) for b in (-1.0, 1.0)]
    assert len(found) == 4 * (top[0] + 1) * (top[1] + 1)

    def bernstein(degree, t):
        return np.array([comb(degree, i) * t**i * (1 - t) ** (degree - i) for i in range(degree + 1)])

    for (up, fast), coefficients in zip(signs, found.reshape(4, top[0] + 1, top[1] + 1, 3, 3), strict=True):
        for u, v in rng.uniform(0.0, 1.0, (5, 2)):
            A = np.einsum("i,j,ijmn->mn", bernstein(m, u), bernstein(k, v), loops[:, :, 0])
            here = np.einsum("a,b,abmn->mn", bernstein(corners[0] - 1, u), bernstein(corners[1] - 1, v), P)
            form = A.T @ here + here @ A + 2.0 * 0.7 * here
            if m:
                form += up * 3.0 / 1500.0 * np.einsum("b,bmn->mn", bernstein(corners[1] - 1, v), P[1] - P[0])
            if k:
                form += fast * 40.0 / 500.0 * np.einsum("a,amn->mn", bernstein(corners[0] - 1, u), P[:, 1] - P[:, 0])
            summed = np.einsum("i,j,ijmn->mn", bernstein(top[0], u), bernstein(top[1], v), coefficients)
            np.testing.assert_allclose(summed, form, rtol=0.0, atol=1e-12 * np.max(np.abs(form)) + 1e-13)


@pytest.mark.parametrize("wrong", [(-1.0, 0.0), (np.nan, 0.0), (1.0, -1.0), (np.inf, 0.0)])
def test_rates_out_of_range_are_refused(proofs, wrong):
    with pytest.raises(ValueError, match="at least 0"):
        scheduling_rates(proofs["lqr"], *wrong)


def test_a_grid_with_a_hole_and_loops_of_another_form_have_no_rate(proofs):
    proof = proofs["nf"]
    tables = proof.family.tables.copy()
    tables[0, 0] = np.nan
    with pytest.raises(ValueError, match="no gains"):
        scheduling_rates(replace(proof, family=replace(proof.family, tables=tables)), 0.0)
    with pytest.raises(ValueError, match="some reason"):
        scheduling_rates(replace(proof, family=None, reason="some reason"), 0.0)
