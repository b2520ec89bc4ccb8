"""Power laws of gains: recovered exactly, predicted by similarity, refused where there is none."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import solve_continuous_are

from design.gains import Gain
from model.examples import WIND_TUNNEL_TRIM, wind_tunnel
from model.flight import flight_grid
from model.linearise import linearise
from model.servo_tab import servo_tab
from model.trim import trim
from schedules.power_laws import PowerLaw, fit_laws

PRESSURES = np.array([245.0, 400.0, 980.0, 1531.25])
GRID = flight_grid(np.array([0.0, 3000.0, 6000.0]), "dynamic_pressure", PRESSURES)
CONDITION = GRID.condition
Q = CONDITION.dynamic_pressure
FLUX = CONDITION.air.density * CONDITION.airspeed
EVERYWHERE = np.ones(GRID.shape, dtype=bool)


def _fit(name, values, ok=EVERYWHERE, condition=CONDITION):
    return fit_laws(condition, (Gain(name, "1", values),), ok)[0]


@pytest.mark.parametrize(
    ("name", "x"), [("K_p", Q), ("K_i", Q), ("K_theta", Q), ("K_d", FLUX), ("K_T_a_da", Q), ("K_T_t_dt_rate", FLUX)]
)
@pytest.mark.parametrize(("c", "a"), [(0.7, -0.5), (-3e-5, 1.25), (2e4, 0.0)])
def test_a_power_law_is_recovered_exactly(name, x, c, a):
    found = _fit(name, c * x**a)
    reference = np.exp(np.mean(np.log(x)))
    assert found.law.reference == pytest.approx(reference, rel=1e-13)
    assert found.law.coefficient == pytest.approx(c * reference**a, rel=1e-12)
    assert found.law.exponent == pytest.approx(a, abs=1e-12)
    assert found.misfit < 1e-12
    assert found.points == 12
    np.testing.assert_allclose(found.law.at(CONDITION), c * x**a, rtol=1e-12)


def test_the_misfit_is_that_of_least_squares_in_logarithms():
    rng = np.random.default_rng(0)
    values = np.exp(rng.normal(size=GRID.shape)) * Q**0.3
    ok = rng.uniform(size=GRID.shape) < 0.7
    found = _fit("K_p", np.where(ok, values, np.nan), ok)
    slope, start = np.polyfit(np.log(Q[ok]), np.log(values[ok]), 1)
    assert found.law.exponent == pytest.approx(slope, rel=1e-10)
    np.testing.assert_allclose(found.law.at(CONDITION), np.exp(start) * Q**slope, rtol=1e-9)
    assert found.misfit == pytest.approx(np.std(np.log(values[ok]) - slope * np.log(Q[ok])), rel=1e-9)
    assert found.points == ok.sum()


def test_gains_without_a_law_say_why():
    assert "changes sign over the grid: from -1 to 2" in _fit("K_p", np.where(Q > 500.0, 2.0, -1.0)).reason
    assert _fit("K_p", np.full(GRID.shape, np.nan), ~EVERYWHERE).reason == "no point carries a gain"
    one = _fit("K_p", np.ones(GRID.shape), Q == 980.0)
    assert one.law is None
    assert one.reason == "the points with such a gain have one dynamic pressure only, 980"
    assert one.misfit is None


def test_gains_of_nothing():
    """A zero has no logarithm: it is left out and counted; zero everywhere stays zero."""
    some = _fit("K_p", np.where(Q < 300.0, 0.0, 2.0 * Q**0.5))
    assert (some.law.exponent, some.points) == (pytest.approx(0.5), 9)
    none = _fit("K_p", np.zeros(GRID.shape))
    assert none.law == PowerLaw("dynamic_pressure", none.law.reference, 0.0, 0.0)
    np.testing.assert_array_equal(none.law.at(CONDITION), 0.0)


def _plant(condition):
    model = linearise(wind_tunnel(), condition, trim(wind_tunnel(), condition, WIND_TUNNEL_TRIM))
    return model, servo_tab(model)


def test_predicted_exponents_are_those_of_constant_non_dimensional_gains():
    """At one density omega_n^2 ~ q and K_ss is constant; at several, only omega_n keeps its power of q."""
    level = flight_grid(np.array([2000.0]), "dynamic_pressure", PRESSURES)
    _, servo = _plant(level.condition)
    omega, steady = np.sqrt(servo.static_stiffness), np.abs(servo.dc_gain)
    gains = {
        "K_p": 0.4 / steady, "K_f": 0.4 / steady, "K_d": 0.3 / (steady * omega), "K_i": 0.2 * omega / steady,
        "K_theta": 3.0 * omega,
    }  # fmt: skip
    for name, values in gains.items():
        found = _fit(name, values, np.ones(level.shape, dtype=bool), level.condition)
        assert found.law.exponent == pytest.approx(found.predicted, abs=1e-9)
        assert found.predicted_by_flux == 2.0 * found.predicted_by_pressure
        assert found.misfit < 1e-9
    predicted = {law.gain: law.predicted for law in (_fit(name, np.ones(GRID.shape)) for name in gains)}
    assert predicted == {"K_p": 0.0, "K_f": 0.0, "K_d": -1.0, "K_i": 0.5, "K_theta": 0.5}


def test_predicted_exponents_of_state_feedback_are_those_of_weights_that_scale_along():
    """An LQR problem that is the same at every point in units of ``c/V`` and ``q c^2 s``, solved in SI by scipy."""
    level = flight_grid(np.array([0.0]), "dynamic_pressure", PRESSURES)
    model, _ = _plant(level.condition)
    names = ("dt", "dt_rate", "da", "da_rate", "int_a")
    K = np.empty((PRESSURES.size, 2, 5))
    for i in range(PRESSURES.size):
        A, B = np.zeros((5, 5)), np.zeros((5, 2))
        A[:4, :4], B[:4], A[4, 2] = model.A[0, i], model.B[0, i], -1.0
        time, torque = 0.6 / level.condition.airspeed[0, i], PRESSURES[i] * 0.6**2 * 0.8
        unit = np.array([1.0, 1.0 / time, 1.0, 1.0 / time, time])
        Q_, R_ = np.diag([1.0, 0.1, 20.0, 0.5, 3.0] / unit**2), np.eye(2) / torque**2
        K[i] = np.linalg.solve(R_, B.T @ solve_continuous_are(A, B, Q_, R_))
    for row, u in enumerate(("T_t", "T_a")):
        for column, x in enumerate(names):
            name = f"K_{u}_{x}"
            found = _fit(name, K[None, :, row, column], np.ones(level.shape, dtype=bool), level.condition)
            assert found.law.exponent == pytest.approx(found.predicted, abs=1e-6)
            assert found.misfit < 1e-6
            assert found.predicted == {"dt": 1.0, "da": 1.0, "dt_rate": 1.0, "da_rate": 1.0, "int_a": 1.5}[x]
    assert _fit("N_T_a_r_a", np.ones(GRID.shape)).predicted == 1.0


def test_one_point_is_the_grid_at_that_point():
    law = _fit("K_d", 2.0 * FLUX**-0.9).law
    whole = law.at(CONDITION)
    for index in np.ndindex(GRID.shape):
        assert law.at(CONDITION.take(index)) == whole[index]
    assert replace(law, exponent=0.0).at(CONDITION.take((0, 0))) == law.coefficient
