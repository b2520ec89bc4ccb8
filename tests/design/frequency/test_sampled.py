from dataclasses import fields, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from design.frequency.margins import margins
from design.frequency.sampled import DiscreteLoop, sampled_margins, sampled_poles
from design.frequency.sampled_plant import sampled_plant
from design.response.transition import transition
from tests.design.siso_loops import same, stabilised

T = 0.1


def ratio_of(decibels):
    return 10.0 ** (decibels / 20.0)


def radius(loop, gain):
    """Largest modulus of the closed loop's eigenvalues at the gains (*G,)."""
    return np.abs(np.linalg.eigvals(loop.closed(np.asarray(gain)))).max(axis=-1)


def integrator(gain, samples, sample_time=T):
    """``gain T / (z^samples (z - 1))``."""
    plant = sampled_plant(np.zeros((1, 1)), np.ones((1, 1)), sample_time, (samples * sample_time,))
    c = np.eye(len(plant.A))[0]
    return DiscreteLoop("test", plant.A, plant.B[:, 0], c, np.array(gain), 1, sample_time)


def held(loop, sample_time, samples=0.0):
    """A continuous loop with its input held and delayed by so many samples."""
    plant = sampled_plant(loop.A, loop.b[..., None], sample_time, (samples * sample_time,))
    rest = np.zeros((*loop.c.shape[:-1], plant.A.shape[-1] - loop.c.shape[-1]))
    c = np.concatenate([loop.c, rest], axis=-1)
    return DiscreteLoop(loop.name, plant.A, plant.B[..., 0], c, loop.gain, loop.sign, sample_time)


def random_loops(count, order, seed, sign=1, gain=1.0):
    """Closed loops with poles anywhere in the unit circle, real negative ones included; half the open ones unstable."""
    rng = np.random.default_rng(seed)
    closed = rng.standard_normal((count, order, order))
    closed *= (rng.uniform(0.2, 0.98, count) / np.abs(np.linalg.eigvals(closed)).max(axis=-1))[:, None, None]
    b = rng.standard_normal((count, order))
    c = rng.standard_normal((count, order)) * rng.choice([0.1, 0.3, 1.0], (count, 1))
    A = closed + b[:, :, None] * c[:, None, :]
    return DiscreteLoop("test", A, sign * b / gain, c, np.full(count, gain), sign, T)


@pytest.mark.parametrize("samples", [0, 1, 2, 5, 18, 19, 20, 40])
def test_integrator_with_whole_samples_of_delay_in_closed_form(samples):
    """At the angle ``t`` a sample: ``|L| = k T / (2 sin(t/2))``, phase ``-pi/2 - t/2 - d t``."""
    k = 0.4 * np.sin(np.pi / (2 * (2 * samples + 1))) * 2.0 / T
    found = sampled_margins(integrator(k, samples))
    turn = 2 * np.arcsin(k * T / 2)
    np.testing.assert_allclose(found.crossover, turn / T, rtol=1e-9)
    margin = np.pi / 2 - (samples + 0.5) * turn
    np.testing.assert_allclose(found.phase_margin, margin, rtol=1e-9)
    np.testing.assert_allclose(found.delay_margin, margin / turn * T, rtol=1e-9)
    # Without delay the pole leaves through -1; the angle is pi / (2 d + 1) else.
    assert np.any(np.abs(found.gain_omega * T - np.pi / (2 * samples + 1)) < 1e-8)
    np.testing.assert_allclose(ratio_of(found.gain_margin_up_db), 1.0 / 0.4, rtol=1e-9)
    assert found.gain_margin_down_db == -np.inf


def test_whole_samples_use_up_the_delay_margin_exactly():
    """With the gain that is critical for four samples of delay, two samples leave two to lose."""
    k = 2.0 * np.sin(np.pi / 18) / T
    found = sampled_margins(integrator(k, 2))
    np.testing.assert_allclose(found.delay_margin, 2 * T, rtol=1e-12)
    assert sampled_poles(integrator(0.9999 * k, 4).closed(), T).stable
    assert not sampled_poles(integrator(1.0001 * k, 4).closed(), T).stable


def test_a_part_of_a_sample_through_the_modified_z_transform():
    """The delay at which the loop with that delay is critical: the more samples a period, the nearer to the margin."""
    loop = stabilised(40, 3, seed=21)
    errors = []
    for sample_time in (0.1, 0.025):
        found = sampled_margins(held(loop, sample_time, 0.3))
        usable = np.flatnonzero(np.isfinite(found.delay_margin) & (found.delay_margin < 2.0))[:8]
        assert usable.size == 8
        for i in usable:
            low, high = 0.3, 0.3 + 2.0 * found.delay_margin[i] / sample_time
            for _ in range(40):
                middle = 0.5 * (low + high)
                stable = sampled_poles(held(loop.take(i), sample_time, middle).closed(), sample_time).stable
                low, high = (middle, high) if stable else (low, middle)
            critical = (low - 0.3) * sample_time
            errors.append(abs(critical / found.delay_margin[i] - 1.0))
            turn = found.crossover[i] * sample_time
            assert abs(critical - found.delay_margin[i]) < 0.3 * turn * sample_time
    assert max(errors[8:]) < 2e-3


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("order", [1, 2, 3, 5, 8])
def test_gain_margins_are_the_edges_of_stability(order, sign):
    loop = random_loops(150, order, seed=order, sign=sign, gain=1.7)
    found = sampled_margins(loop)
    assert not np.any(np.isnan(found.disk_margin))
    up, down = ratio_of(found.gain_margin_up_db), ratio_of(found.gain_margin_down_db)
    for ratio, has, inward in ((up, np.isfinite(up), -1e-6), (down, down > 0.0, 1e-6)):
        edge = np.where(has, ratio, 1.0) * loop.gain
        assert np.all(radius(loop, edge * (1 + inward))[has] < 1.0)
        assert np.all(radius(loop, edge * (1 - inward))[has] > 1.0)
    # Every loop that is sampled has a largest gain, and each unstable open loop a smallest one.
    assert np.all(np.isfinite(up))
    assert np.all(down[radius(loop, 0.0 * loop.gain) > 1.0] > 0.0)
    for part in np.linspace(0.0, 0.999, 20):
        assert np.all(radius(loop, loop.gain * up**part) < 1.0)
        assert np.all(radius(loop, loop.gain * np.maximum(down, 1e-5) ** part) < 1.0)


@pytest.mark.parametrize("order", [1, 3, 6])
def test_lists_put_poles_on_the_circle(order):
    loop = random_loops(150, order, seed=30 + order)
    found = sampled_margins(loop)
    assert found.gain_ratio.shape == (150, order + 1)
    assert np.nanmax(found.gain_omega) == np.pi / T
    assert np.nanmax(found.phase_omega) < np.pi / T
    outer = loop.b[:, :, None] * loop.c[:, None, :]
    for values, omega, factor in (
        (found.gain_ratio, found.gain_omega, lambda v: v + 0j),
        (found.phase, found.phase_omega, lambda v: np.exp(-1j * v)),
    ):
        rows, column = np.nonzero(~np.isnan(values))
        turned = factor(values[rows, column])[:, None, None] * outer[rows]
        z = np.linalg.eigvals(loop.A[rows] - turned)
        distance = np.abs(z - np.exp(1j * omega[rows, column] * T)[:, None]).min(axis=-1)
        assert np.all(distance < 1e-9 * np.maximum(1.0, np.abs(z).max(axis=-1)))


@pytest.mark.parametrize("order", [2, 5])
def test_phase_margin_is_the_edge_of_stability(order):
    loop = random_loops(150, order, seed=40 + order)
    found = sampled_margins(loop)
    has = np.isfinite(found.phase_margin)
    assert has.any()
    outer = loop.b[:, :, None] * loop.c[:, None, :]

    def grown(phase):
        return np.abs(np.linalg.eigvals(loop.A - np.exp(-1j * phase)[:, None, None] * outer)).max(axis=-1)

    margin = np.where(has, found.phase_margin, np.pi)
    for part in np.linspace(0.0, 1.0 - 1e-6, 12):
        assert np.all(grown(part * margin) < 1.0)
        assert np.all(grown(-part * margin) < 1.0)
    assert np.all(np.maximum(grown(margin * (1 + 1e-6)), grown(-margin * (1 + 1e-6)))[has] > 1.0)


@pytest.mark.parametrize("order", [1, 4, 7])
def test_peaks_equal_a_search_on_the_circle(order):
    loop = random_loops(60, order, seed=50 + order)
    found = sampled_margins(loop)
    for i in range(60):
        pole, V = np.linalg.eig(loop.closed()[i])
        residue = (loop.c[i] @ V) * np.linalg.solve(V, loop.b[i].astype(complex))
        near = np.abs(np.angle(pole))[:, None] + (1.0 - np.abs(pole))[:, None] * np.linspace(-4, 4, 801)
        angle = np.concatenate([np.linspace(0.0, np.pi, 4001), np.clip(near.ravel(), 0.0, np.pi)])
        response = (residue / (np.exp(1j * angle)[:, None] - pole)).sum(axis=-1)
        for ours, factor in ((found.sensitivity_peak[i], 1.0), (2.0 / found.disk_margin[i], 2.0)):
            searched = max(np.abs(1.0 - factor * response).max(), 1.0)
            assert searched * (1 - 1e-9) < ours < searched * (1 + 1e-4)


def test_no_factor_of_the_disk_destabilises():
    loop = random_loops(80, 4, seed=60)
    found = sampled_margins(loop)
    rng = np.random.default_rng(0)
    for _ in range(40):
        d = found.disk_margin * 0.9999 * np.exp(2j * np.pi * rng.random(80))
        factor = ((1.0 + d / 2.0) / (1.0 - d / 2.0))[:, None, None]
        turned = loop.A - factor * loop.b[:, :, None] * loop.c[:, None, :]
        assert np.all(np.abs(np.linalg.eigvals(turned)).max(axis=-1) < 1.0)


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("order", [1, 2, 3, 4])
def test_agrees_with_python_control_where_that_looks(order):
    """It leaves out the ends of the circle, z = 1 and z = -1, where gains are critical more often than not."""
    import control

    loop = stabilised(60, order, seed=70 + order)
    found = sampled_margins(held(loop, 0.3))
    stable = np.flatnonzero(~np.isnan(found.disk_margin))
    assert stable.size > 40
    for i in stable:
        system = control.ss(loop.A[i], loop.b[i][:, None], loop.c[i][None, :], 0)
        sampled = control.sample_system(system, 0.3, "zoh")
        gain, phase, _, turnover, crossover, _ = control.stability_margins(sampled, returnall=True)
        inside = (found.gain_omega[i] > 0.0) & (found.gain_omega[i] < np.pi / 0.3)
        theirs = (gain > 1e-6) & (gain < 1e6) & (turnover > 0.0) & (turnover < np.pi / 0.3 * (1 - 1e-6))
        np.testing.assert_allclose(np.sort(found.gain_ratio[i][inside]), np.sort(gain[theirs]), rtol=1e-8)
        there = ~np.isnan(found.phase[i])
        # It takes |L| = 1.0016 for a crossover (order 4, twice at 0.41 rad/s).
        true = np.abs(np.abs(sampled(np.exp(0.3j * crossover))) - 1.0) < 1e-6
        crossover, phase = crossover[true], np.abs(phase[true])
        np.testing.assert_allclose(found.phase_omega[i][there], np.sort(crossover), rtol=1e-7)
        theirs = phase[np.argsort(crossover)]
        np.testing.assert_allclose(np.abs(np.rad2deg(found.phase[i][there])), theirs, rtol=0.0, atol=1e-6)


@pytest.mark.parametrize("samples", [0.0, 1.0, 1.5])
def test_fast_sampling_goes_over_into_the_continuous_loop(samples):
    """At first order: the hold and the delay take ``(1/2 + samples) T`` times the frequency from the phase."""
    loop = stabilised(60, 4, seed=90)
    loop = loop.take(margins(loop).sensitivity_peak < 4.0)
    limit = margins(loop)
    assert len(limit.disk_margin) > 25
    errors = []
    for sample_time in (4e-4, 2e-4, 1e-4):
        found = sampled_margins(held(loop, sample_time, samples))
        lag = (0.5 + samples) * sample_time * limit.phase_omega
        crossed = ~np.isnan(limit.phase)
        assert np.all(np.abs((limit.phase - lag - found.phase[:, :4])[crossed]) < 200.0 * sample_time**2 + 1e-7)
        finite = np.isfinite(limit.gain_margin_down_db)
        np.testing.assert_array_equal(finite, np.isfinite(found.gain_margin_down_db))
        errors.append(
            [
                np.abs(found.phase_omega[:, :4] - limit.phase_omega)[crossed].max(),
                np.abs(found.gain_margin_down_db[finite] - limit.gain_margin_down_db[finite]).max(),
                np.abs(found.disk_margin - limit.disk_margin).max(),
                np.abs(found.sensitivity_peak - limit.sensitivity_peak).max(),
            ]
        )
    errors = np.array(errors)
    # The hold's magnitude is of second order, so that crossovers are.
    assert np.all(errors[2] < 0.02)
    assert np.all(np.abs(errors[1:, 1:] / errors[:-1, 1:] - 0.5) < 0.05)
    assert np.all(errors[1:, 0] < 0.3 * errors[:-1, 0] + 1e-8)


def test_unstable_loops_have_no_margins_and_leave_the_others_alone():
    """Unstable, a pole at -1 of the open loop, one of the closed loop, one at 1: the others are as they are alone."""
    good = random_loops(6, 2, seed=100)
    A, b, c = good.A.copy(), good.b.copy(), good.c.copy()
    A[1] *= 40.0
    A[2], b[2], c[2] = np.diag([-1.0, 0.5]), [1.0, 1.0], [-0.3, 0.2]
    A[3], b[3], c[3] = np.diag([0.0, 0.5]), [1.0, 0.0], [1.0, 0.0]
    A[4], b[4], c[4] = np.diag([1.0, 0.5]), [0.0, 1.0], [1.0, 0.1]
    found = sampled_margins(replace(good, A=A, b=b, c=c))
    assert np.isnan(found.disk_margin).tolist() == [False, True, False, True, True, False]
    for field in fields(found):
        values = getattr(found, field.name)
        for i in (1, 3, 4):
            assert np.all(np.isnan(values[i]))
        alone = getattr(sampled_margins(good), field.name)
        for i in (0, 5):
            same(values[i], alone[i], 1e-12)
    # Its gain is critical where it leaves through -1: at 0, which is no margin, and beyond.
    down = found.gain_margin_down_db[2]
    assert down == -np.inf
    edge = float(ratio_of(found.gain_margin_up_db[2]))
    point = DiscreteLoop("test", A[2], b[2], c[2], np.array(1.0), 1, T)
    assert radius(point, 0.999 * edge) < 1.0 < radius(point, 1.001 * edge)


def test_an_open_circuit_has_every_margin():
    found = sampled_margins(replace(random_loops(1, 3, seed=3).take(0), A=0.5 * np.eye(3), gain=np.array(0.0)))
    assert (found.gain_margin_up_db, found.gain_margin_down_db) == (np.inf, -np.inf)
    assert (found.phase_margin, found.delay_margin) == (np.inf, np.inf)
    assert (found.disk_margin, found.sensitivity_peak) == (2.0, 1.0)


def test_what_makes_no_sense_is_refused():
    loop = random_loops(2, 3, seed=4)
    with pytest.raises(ValueError, match="sample time"):
        sampled_margins(replace(loop, sample_time=0.0))
    with pytest.raises(np.linalg.LinAlgError):
        sampled_margins(replace(loop, A=np.full((2, 3, 3), np.nan)))
    with pytest.raises(ValueError, match="61"):
        sampled_margins(integrator(0.01, 60))


def test_equivalent_poles_are_those_of_the_continuous_loop():
    loop = stabilised(30, 4, seed=110)
    A = loop.closed()
    found = sampled_poles(transition(A, 0.01), 0.01)
    expected = np.linalg.eigvals(A)
    for i in range(30):
        np.testing.assert_allclose(
            np.sort_complex(found.equivalent[i]), np.sort_complex(expected[i]), rtol=1e-9, atol=1e-10
        )
        np.testing.assert_allclose(np.sort(found.damping_ratio[i]), np.sort(-expected[i].real / abs(expected[i])))
    assert found.stable.all()
    np.testing.assert_allclose(np.exp(found.equivalent * 0.01), found.z, rtol=1e-12)


def test_poles_of_modes_that_end_and_that_alternate():
    found = sampled_poles(np.stack([np.diag([0.0, 0.5, -0.5]), np.diag([0.2, 1.1, 0.0]), np.diag([1.0, 0.1, 0.0])]), T)
    assert found.stable.tolist() == [True, False, False]
    first = found.equivalent[0]
    assert first[0] == -np.inf
    assert found.damping_ratio[0, 0] == 1.0
    np.testing.assert_allclose(first[1:], [np.log(0.5) / T, (np.log(0.5) + 1j * np.pi) / T])
    np.testing.assert_allclose(found.damping_ratio[0, 1:], [1.0, np.log(2) / np.hypot(np.log(2), np.pi)])
    np.testing.assert_allclose(found.z[0], [0.0, 0.5, -0.5], atol=1e-15)
    np.testing.assert_allclose(found.damping_ratio[1, -1], -1.0)


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 10_000), order=st.integers(1, 6), unit=st.floats(1e-4, 1e3))
def test_the_unit_of_time_and_the_states_do_not_matter(seed, order, unit):
    loop = random_loops(4, order, seed)
    scale = 2.0 ** np.round(np.random.default_rng(seed).uniform(-6, 6, order))
    changed = replace(loop, A=loop.A / scale[:, None] * scale, b=loop.b / scale, c=loop.c * scale, sample_time=T * unit)
    found, expected = sampled_margins(changed), sampled_margins(loop)
    for name in ("gain_ratio", "gain_margin_up_db", "phase", "disk_margin", "sensitivity_peak"):
        same(getattr(found, name), getattr(expected, name), 1e-6)
    same(found.phase_omega * unit, expected.phase_omega, 1e-6)
    same(found.delay_margin / unit, expected.delay_margin, 1e-6)


@pytest.mark.parametrize("samples", [1.5, 24.0])
def test_grid_equals_points(samples):
    loop = held(stabilised(6, 3, seed=120), 0.004, samples)
    n = loop.A.shape[-1]
    shaped = replace(
        loop, A=loop.A.reshape(2, 3, n, n), b=loop.b.reshape(2, 3, n), c=loop.c.reshape(2, 3, n),
        gain=loop.gain.reshape(2, 3),
    )  # fmt: skip
    found, poles = sampled_margins(shaped), sampled_poles(shaped.closed(), 0.004)
    assert found.phase.shape == (2, 3, n)
    assert found.gain_ratio.shape == (2, 3, 16 if samples > 20 else n + 1)
    for i in np.ndindex(2, 3):
        one = sampled_margins(shaped.take(i))
        for field in fields(found):
            same(getattr(found.take(i), field.name), getattr(one, field.name), 1e-10)
        np.testing.assert_array_equal(poles.take(i).z, sampled_poles(shaped.take(i).closed(), 0.004).z)
