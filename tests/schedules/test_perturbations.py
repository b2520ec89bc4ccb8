"""Perturbed plants against a fresh linearisation of perturbed hinge moments and bodies; draws and corners."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import kstest, truncnorm, uniform

from model.hinge_moments.taylor import fit_taylor
from model.hinge_moments.xfoil_naca23012 import AILERON_HINGE, TAB_HINGE, xfoil_naca23012
from model.linearise import linearise
from model.motion import acceleration, required_torque
from model.servo_tab import servo_tab
from schedules.analysis import analyse
from schedules.perturbations import (
    BLOCK,
    PARAMETERS,
    Cases,
    Uncertainty,
    corner_cases,
    drawn_cases,
    perturbed_model,
)
from tests.schedules.flown_cases import turned_system

EVERY_POINT = np.arange(8)


@pytest.fixture(scope="module")
def plants(wind_tunnel_study):
    """Envelopes of every damping, of a curved table, and with what else the air adds."""
    study = wind_tunnel_study

    def plant(**options):
        return analyse(replace(study, aerodynamics=replace(study.aerodynamics, **options)))

    geometry = replace(study.geometry, aileron_hinge=AILERON_HINGE, tab_hinge=TAB_HINGE)
    curved = fit_taylor(xfoil_naca23012(), 3)
    trim = replace(study.trim, tab=0.05, aileron=-0.08)
    aerodynamics = replace(study.aerodynamics, source=curved)
    return {
        "thesis": analyse(study),
        "quasi_steady": plant(damping="quasi_steady", compressibility="prandtl_glauert", virtual_inertia=True),
        "unsteady": plant(damping="unsteady", virtual_inertia=True),
        "curved": analyse(replace(study, geometry=geometry, aerodynamics=aerodynamics, trim=trim)),
    }


KINDS = ["thesis", "quasi_steady", "unsteady", "curved"]


def _random_factors(seed, count=8):
    return np.random.default_rng(seed).uniform(0.4, 1.6, (count, len(PARAMETERS)))


@pytest.mark.parametrize("kind", KINDS)
def test_factors_of_one_are_the_plant_itself(plants, kind):
    plant = plants[kind]
    model = perturbed_model(plant, EVERY_POINT, PARAMETERS, np.ones((8, len(PARAMETERS))))
    for name in ("A", "B", "C", "stiffness", "damping", "inertia", "lag_torque", "input_offset", "state_offset"):
        nominal = getattr(plant.model, name)
        np.testing.assert_allclose(getattr(model, name), nominal.reshape(8, *nominal.shape[2:]), rtol=1e-14, atol=1e-13)
    assert model.states == plant.model.states


@pytest.mark.parametrize("kind", KINDS)
def test_equals_a_fresh_linearisation_of_the_perturbed_section(plants, kind):
    """The whole section is perturbed, hinge moments as a source of its own, and linearised one point at a time."""
    plant, factors = plants[kind], _random_factors(1)
    model = perturbed_model(plant, EVERY_POINT, PARAMETERS, factors)
    for i in EVERY_POINT:
        at = np.unravel_index(i, plant.grid.shape)
        trim, condition = plant.trim.take(at), plant.grid.condition.take(at)
        system = turned_system(plant.system, trim, dict(zip(PARAMETERS, factors[i], strict=True)))
        fresh = linearise(system, condition, trim)
        for name in ("A", "B", "stiffness", "damping", "inertia", "lag_torque"):
            wanted = getattr(fresh, name)
            size = np.max(np.abs(wanted), initial=0.0)
            np.testing.assert_allclose(getattr(model, name)[i], wanted, rtol=1e-12, atol=1e-12 * size)
        # And the nominal trim is a trim of the perturbed section.
        torque = required_torque(system, condition, trim.alpha, trim.state, np.zeros(2))
        np.testing.assert_allclose(torque, model.input_offset[i], rtol=1e-12)


@pytest.mark.parametrize("kind", KINDS)
def test_is_the_derivative_of_the_perturbed_equations_of_motion(plants, kind):
    plant, factors = plants[kind], _random_factors(2)
    model = perturbed_model(plant, EVERY_POINT, PARAMETERS, factors)
    for i in (0, 5):
        at = np.unravel_index(i, plant.grid.shape)
        trim, condition = plant.trim.take(at), plant.grid.condition.take(at)
        system = turned_system(plant.system, trim, dict(zip(PARAMETERS, factors[i], strict=True)))
        state, n = model.state_offset[i], len(model.states)
        for column in range(n):
            step = np.zeros(n)
            step[column] = 1e-5
            ends = [acceleration(system, condition, trim.alpha, state + x, trim.torque) for x in (step, -step)]
            slope = (ends[0] - ends[1]) / 2e-5
            np.testing.assert_allclose(model.A[i, [1, 3], column], slope, rtol=1e-5, atol=1e-5 * np.abs(slope).max())


def test_scaled_matrices(plants):
    """Stiffness follows its derivatives entry by entry, and the thesis's damping by seed 2.2.12 and 2.2.13."""
    plant, names = plants["thesis"], ("C_Ht_dt", "C_Ht_da", "C_Ha_dt", "C_Ha_da")
    factors = np.array([0.7, 1.2, 0.9, 1.4])
    model = perturbed_model(plant, EVERY_POINT, names, np.tile(factors, (8, 1)))
    stiffness = plant.model.stiffness.reshape(8, 2, 2) * factors.reshape(2, 2)
    np.testing.assert_allclose(model.stiffness, stiffness, rtol=1e-14)
    V, geometry = plant.grid.condition.airspeed.ravel(), plant.system.geometry
    induced = np.array([[geometry.tab_chord / 4.0, geometry.aileron_chord], [0.0, geometry.aileron_chord / 4.0]])
    np.testing.assert_allclose(model.damping, stiffness @ induced / V[:, None, None], rtol=1e-13)
    np.testing.assert_array_equal(model.inertia, plant.model.inertia.reshape(8, 2, 2))


@pytest.mark.parametrize("factor", [0.5, 0.9, 1.0, 1.7])
def test_a_servo_tab_of_scaled_stiffness(plants, factor):
    """Both derivatives of the aileron by f: frequency and damping ratio by its root, and no change of the DC gain."""
    plant = plants["thesis"]
    nominal = servo_tab(plant.model)
    found = servo_tab(perturbed_model(plant, EVERY_POINT, ("C_Ha_da", "C_Ha_dt"), np.full((8, 2), factor)))
    np.testing.assert_allclose(found.natural_frequency, nominal.natural_frequency.ravel() * factor**0.5, rtol=1e-13)
    np.testing.assert_allclose(found.damping_ratio, nominal.damping_ratio.ravel() * factor**0.5, rtol=1e-13)
    np.testing.assert_allclose(found.dc_gain, nominal.dc_gain.ravel(), rtol=1e-13)


def test_a_servo_tab_of_scaled_inertia(plants):
    plant = plants["thesis"]
    found = perturbed_model(plant, EVERY_POINT, ("aileron_inertia",), np.full((8, 1), 1.3))
    more = 0.3 * plant.system.inertia.aileron.inertia
    J = plant.model.inertia[0, 0]
    np.testing.assert_allclose(found.inertia - J, np.broadcast_to([[0.0, 0.0], [0.0, more]], (8, 2, 2)), atol=1e-18)
    ratio = np.sqrt(J[1, 1] / (J[1, 1] + more))
    omega = servo_tab(found).natural_frequency
    np.testing.assert_allclose(omega, plant.servo_tab.natural_frequency.ravel() * ratio, rtol=1e-13)


@pytest.mark.parametrize("kind", KINDS)
def test_many_plants_are_the_same_as_one_after_the_other(plants, kind):
    plant, points = plants[kind], np.array([3, 0, 3, 7, 5, 3])
    factors = _random_factors(4, 6)
    together = perturbed_model(plant, points, PARAMETERS, factors)
    for i in range(6):
        alone = perturbed_model(plant, points[i : i + 1], PARAMETERS, factors[i : i + 1])
        np.testing.assert_array_equal(alone.A[0], together.A[i])


def test_mass_and_inertia_must_stay_positive(plants):
    with pytest.raises(ValueError, match="inertia"):
        perturbed_model(plants["thesis"], np.array([0]), ("tab_inertia",), np.array([[-0.1]]))


# Draws and corners.

UNIFORM = Uncertainty("C_Ha_da", 0.3)
NORMAL = Uncertainty("C_Ha_dt", 0.2, 0.1)
INERTIA = Uncertainty("tab_inertia", 0.1)


def test_corners_are_all_combinations():
    cases = corner_cases([UNIFORM, NORMAL, INERTIA])
    assert cases.parameters == ("C_Ha_da", "C_Ha_dt", "tab_inertia")
    assert len(cases) == 8
    np.testing.assert_allclose(cases.factors[0], [0.7, 0.8, 0.9])
    np.testing.assert_allclose(cases.factors[1], [0.7, 0.8, 1.1])
    np.testing.assert_allclose(cases.factors[-1], [1.3, 1.2, 1.1])
    assert len({tuple(row) for row in np.sign(cases.factors - 1.0)}) == 8
    assert not cases.factors.flags.writeable


def test_a_shorter_request_draws_the_first_of_a_longer_one():
    long = drawn_cases([UNIFORM, NORMAL], 3 * BLOCK + 7, 5).factors
    for draws in (1, 2, BLOCK - 1, BLOCK, BLOCK + 1, 3 * BLOCK):
        np.testing.assert_array_equal(drawn_cases([UNIFORM, NORMAL], draws, 5).factors, long[:draws])


def test_draws_of_a_parameter_do_not_depend_on_the_others():
    alone = drawn_cases([NORMAL], 300, 5).factors[:, 0]
    for others in ([UNIFORM, NORMAL], [INERTIA, UNIFORM, NORMAL], [NORMAL, UNIFORM]):
        np.testing.assert_array_equal(drawn_cases(others, 300, 5).factors[:, others.index(NORMAL)], alone)


def test_seeds_and_blocks_and_parameters_have_streams_of_their_own():
    streams = [drawn_cases([UNIFORM], 3 * BLOCK, seed).factors[:, 0] for seed in (0, 1, 2)]
    parts = [stream[k * BLOCK : (k + 1) * BLOCK] for stream in streams for k in range(3)]
    parts += [drawn_cases([replace(UNIFORM, parameter="C_Ht_da")], BLOCK, 0).factors[:, 0]]
    correlation = np.corrcoef(parts) - np.eye(len(parts))
    assert np.abs(correlation).max() < 0.25
    assert len({part[0] for part in parts}) == len(parts)


def test_draws_have_their_distributions():
    """Of many seeds the p-values of the Kolmogorov-Smirnov test are themselves uniform."""
    narrow = Uncertainty("tab_mass", 0.3, 0.02)
    wanted = uniform(0.7, 0.6), truncnorm(-2.0, 2.0, 1.0, 0.1), truncnorm(-15.0, 15.0, 1.0, 0.02)
    found = [drawn_cases([UNIFORM, NORMAL, narrow], 2000, seed).factors for seed in range(60)]
    for column, distribution in enumerate(wanted):
        values = [kstest(factors[:, column], distribution.cdf).pvalue for factors in found]
        assert kstest(values, "uniform").pvalue > 0.01
    everything = np.concatenate(found)
    assert np.abs(np.corrcoef(everything.T) - np.eye(3)).max() < 0.01


@given(st.floats(1e-6, 0.999), st.none() | st.floats(1e-9, 1e9), st.integers(0, 2**40), st.sampled_from(PARAMETERS))
def test_draws_stay_within_the_largest_change(change, deviation, seed, parameter):
    factors = drawn_cases([Uncertainty(parameter, change, deviation)], 50, seed).factors
    assert np.all(np.abs(factors - 1.0) <= change * (1.0 + 1e-12))
    assert np.all(factors > 0.0)
    assert len(np.unique(factors)) == 50


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: Uncertainty("C_La", 0.1), "parameter must be one of"),
        (lambda: Uncertainty("C_Ha_da", 1.0), "change"),
        (lambda: Uncertainty("C_Ha_da", 0.0), "change"),
        (lambda: Uncertainty("C_Ha_da", float("nan")), "change"),
        (lambda: Uncertainty("C_Ha_da", 0.1, 0.0), "deviation"),
        (lambda: Uncertainty("C_Ha_da", 0.1, float("inf")), "deviation"),
        (lambda: corner_cases([]), "at least one"),
        (lambda: corner_cases([UNIFORM, UNIFORM]), "twice"),
        (lambda: corner_cases([Uncertainty(p, 0.1) for p in PARAMETERS[:7]]), "too many corners"),
        (lambda: drawn_cases([UNIFORM], 0, 0), "draws"),
        (lambda: drawn_cases([UNIFORM], 10**7, 0), "draws"),
        (lambda: drawn_cases([UNIFORM], 1, -1), "seed"),
        (lambda: Cases(("C_Ha_da",), np.ones((3, 2))), "one row a case"),
        (lambda: Cases(("C_Ha_da",), np.array([[np.nan]])), "finite"),
        (lambda: Cases(("lift",), np.ones((3, 1))), "parameter must be one of"),
    ],
)
def test_refused(make, said):
    with pytest.raises(ValueError, match=said):
        make()
