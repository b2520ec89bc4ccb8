"""Thin-aerofoil derivatives of five hinge pairs, and what follows for the two wind-tunnel data sets.

The derivatives were computed apart from this code, by quadrature of the vorticity to thirty digits and by
a cosine series of two million terms; the dynamics from those derivatives by an independent script. All are
printed to ten digits, so comparisons are to 1e-9 relative, eigenvalues to 1e-8 of their size.
"""

from dataclasses import replace

import numpy as np
import pytest

from model import examples
from model.flight import flight_condition
from model.hinge_moments.camber import mean_line
from model.hinge_moments.closed_forms import acceleration_moment, between_surfaces, rate_moment
from model.hinge_moments.compressibility import prandtl_glauert
from model.hinge_moments.lift import (
    flap_lift,
    ideal_incidence,
    ideal_lift,
    quarter_chord_moment,
    zero_lift_angle,
)
from model.hinge_moments.thin_aerofoil import ThinAerofoil
from model.linearise import linearise
from model.servo_tab import servo_tab
from model.trim import trim

PAIRS = [(0.70, 0.88), (0.75, 0.90), (0.80, 0.95), (0.60, 0.80), (0.70, 0.97)]
# First index of a name: hinge of the moment; second: what moves. Normalised by the wing chord squared.
NUMBERS = {
    "Ga_a": [5.646663413e-02, 3.533420353e-02, 1.997526020e-02, 1.191686026e-01, 5.646663413e-02],
    "Ga_t": [5.464993030e-03, 3.448558569e-03, 6.028102986e-04, 1.997526020e-02, 1.673593784e-04],
    "G_aa": [8.688623941e-02, 5.897549151e-02, 3.691506943e-02, 1.620251586e-01, 8.688623941e-02],
    "G_at": [1.290746207e-01, 8.880096923e-02, 5.327242405e-02, 2.310965622e-01, 9.039877521e-02],
    "G_ta": [7.588605330e-03, 5.148178392e-03, 9.698213926e-04, 2.515494098e-02, 2.262057134e-04],
    "G_tt": [1.284021306e-02, 8.842293771e-03, 2.165389072e-03, 3.691506943e-02, 7.732241292e-04],
    "D_aa": [6.119403485e-02, 3.539806775e-02, 1.811784454e-02, 1.452274091e-01, 6.119403485e-02],
    "D_at": [2.397634182e-02, 1.386942229e-02, 3.874944044e-03, 7.422573827e-02, 3.641028968e-03],
    "D_ta": [6.974662180e-03, 4.036536761e-03, 6.539609084e-04, 2.839237836e-02, 2.284033239e-04],
    "D_tt": [3.912091474e-03, 2.263814112e-03, 2.829504837e-04, 1.811784454e-02, 6.111613959e-05],
    "A_aa": [4.347786551e-03, 2.116862790e-03, 8.751044778e-04, 1.346641919e-02, 4.347786551e-03],
    "A_at": [5.974353158e-04, 2.900714299e-04, 3.962723349e-05, 3.094894154e-03, 2.148631566e-05],
    "A_ta": [5.974353158e-04, 2.900714299e-04, 3.962723349e-05, 3.094894154e-03, 2.148631566e-05],
    "A_tt": [1.150282957e-04, 5.566289842e-05, 3.508173735e-06, 8.751044778e-04, 4.561517841e-07],
    "G0_a 23012": [1.353901352e-03, 8.451973110e-04, 4.767683626e-04, 2.873000587e-03, 1.353901352e-03],
    "G0_t 23012": [1.300277834e-04, 8.199113503e-05, 1.430721432e-05, 4.767683626e-04, 3.969508670e-06],
    "G0_a 2412": [6.187781108e-03, 3.957270312e-03, 2.285025820e-03, 1.247819471e-02, 6.187781108e-03],
    "G0_t 2412": [6.459549991e-04, 4.108774785e-04, 7.324185256e-05, 2.285025820e-03, 2.049140467e-05],
    "cl_beta_a": [4.151589239, 3.826445910, 3.454590436, 4.698468606, 4.151589239],
    "cl_beta_t": [2.714812568, 2.487002218, 1.773833412, 3.454590436, 1.378680927],
}
DETERMINANT_OF_STIFFNESS = [1.361415e-04, 6.431539e-05, 2.827075e-05, 1.679496e-04, 4.673382e-05]


def computed(aileron_hinge, tab_hinge):
    """The same quantities from the product, under the same names."""
    named = {}
    source = ThinAerofoil(aileron_hinge, tab_hinge)
    rates = between_surfaces(rate_moment, aileron_hinge, tab_hinge)
    accelerations = between_surfaces(acceleration_moment, aileron_hinge, tab_hinge)
    for i, h in enumerate("ta"):
        named[f"Ga_{h}"] = -source.gradient[i, 0]
        for j, f in enumerate("ta"):
            named[f"G_{h}{f}"] = source.gradient[i, 1 + j]
            named[f"D_{h}{f}"] = rates[i, j]
            named[f"A_{h}{f}"] = accelerations[i, j]
        for section in ("23012", "2412"):
            cambered = ThinAerofoil(aileron_hinge, tab_hinge, mean_line(section))
            named[f"G0_{h} {section}"] = -cambered.offset[i]
    named["cl_beta_a"], named["cl_beta_t"] = flap_lift(aileron_hinge), flap_lift(tab_hinge)
    return named


@pytest.mark.parametrize("column", range(len(PAIRS)), ids=[str(p) for p in PAIRS])
def test_derivatives_of_five_hinge_pairs(column):
    values = computed(*PAIRS[column])
    assert set(values) == set(NUMBERS)
    for name, row in NUMBERS.items():
        assert float(values[name]) == pytest.approx(row[column], rel=1e-9), name
    determinant = values["G_tt"] * values["G_aa"] - values["G_ta"] * values["G_at"]
    assert determinant == pytest.approx(DETERMINANT_OF_STIFFNESS[column], rel=1e-6)


def test_derivatives_of_data_set_a():
    gradient = examples.wind_tunnel().aerodynamics.source.gradient[:, 1:]
    expected = [[1.380211417e-3, 4.792076535e-4], [8.977814443e-2, 7.499353901e-2]]
    np.testing.assert_allclose(gradient, expected, rtol=1e-9)


# Seed Fig 2.3: NACA 23012, hinges 0.7 and 0.88, alpha 5, aileron 10, tab -10 degrees. Which sense of the
# deflections the figure shows cannot be told from the text: both are computed.
FIG_2_3 = {
    "te_up": (
        [-1.523516852e-03, -1.364480636e-02],
        [1.3767689401, 0.5642189823, 0.1751064908, 0.1468759179, 0.2393713234],
    ),
    "te_down": (
        [-3.096400655e-04, -1.081716823e-03],
        [2.3110612360, 1.0730435883, 0.7277420447, 0.2987455238, -0.0355511181],
    ),
}


@pytest.mark.parametrize("positive", FIG_2_3)
def test_case_of_figure_2_3(positive):
    source = ThinAerofoil(0.70, 0.88, mean_line("NACA 23012"), positive)
    angles = np.deg2rad([5.0, -10.0, 10.0])
    coefficients, load = FIG_2_3[positive]
    x = np.array([0.05, 0.25, 0.5, 0.8, 0.95])
    np.testing.assert_allclose(source.at(*angles).value, coefficients, rtol=1e-9)
    np.testing.assert_allclose(source.pressure_difference(x, *angles), load, atol=6e-11, rtol=1e-9)


def test_mean_lines():
    # NACA 230 line: published design cl 0.30, ideal incidence 1.65 deg, cm -0.013 (Abbott and von Doenhoff).
    line = mean_line("NACA 23012")
    assert np.rad2deg(zero_lift_angle(line)) == pytest.approx(-1.09358667, abs=6e-9)
    assert quarter_chord_moment(line) == pytest.approx(-0.01283566, abs=6e-9)
    assert ideal_lift(line) == pytest.approx(0.30004, abs=6e-6)
    assert np.rad2deg(ideal_incidence(line)) == pytest.approx(1.64247, abs=6e-6)
    line = mean_line("NACA 2412")
    assert np.rad2deg(zero_lift_angle(line)) == pytest.approx(-2.07724040, abs=6e-9)
    assert quarter_chord_moment(line) == pytest.approx(-0.05311951, abs=6e-9)


def test_prandtl_glauert_factors():
    factors = {
        0.147: 1.010982820,
        0.3: 1.048284837,
        0.5: 1.154700538,
        0.6: 1.25,
        0.7: 1.400280084,
        0.78: 1.598006930,
        0.82: 1.747141395,
    }
    np.testing.assert_allclose(prandtl_glauert(np.array(list(factors))), list(factors.values()), rtol=1e-9)


def test_inertia_of_data_set_a():
    expected = [[2.100405e-4, 2.1652050e-4], [2.1652050e-4, 5.5098005e-3]]
    np.testing.assert_allclose(examples.wind_tunnel().inertia_matrix, expected, rtol=1e-8)


# At 50 m/s in air of 1.225 kg/m^3: one of each complex pair, per data set, damping and virtual inertia.
EIGENVALUES = {
    ("wind_tunnel", "thesis", False): [-43.82129843 + 44.57193446j, 29.11076492 + 43.17431354j],
    ("wind_tunnel", "quasi_steady", False): [-49.22154174 + 37.74013518j, 25.1931843 + 46.03226451j],
    ("wind_tunnel", "quasi_steady", True): [-48.32031454 + 37.58953434j, 25.15044564 + 45.68597224j],
    ("wind_tunnel_23012", "thesis", False): [-15.56760857 + 114.6840267j, 0.3746156424 + 26.52809999j],
    ("wind_tunnel_23012", "quasi_steady", False): [-41.40140005 + 111.9133774j, 0.657290132 + 25.7241237j],
    ("wind_tunnel_23012", "quasi_steady", True): [-39.9506365 + 108.7475089j, 0.7122527629 + 25.89413691j],
}
# numerator [beta1, beta0], denominator [2 zeta omega, omega^2], gain, pole, zero
SERVO = {
    ("wind_tunnel", "thesis"): (
        [-0.862292456, -7185.770464],
        [29.18622369, 6002.422539],
        -1.197145056,
        -14.59311185 + 76.08852493j,
        -8333.33333333,
    ),
    ("wind_tunnel_23012", "thesis"): (
        [-2.444813247, -6791.147908],
        [28.56243139, 4571.443247],
        -1.485558836,
        -14.2812157 + 66.08698908j,
        -2777.77777778,
    ),
    ("wind_tunnel", "quasi_steady"): (None, None, -1.197145056, -23.88875934 + 73.70040513j, -1520.45),
    ("wind_tunnel_23012", "quasi_steady"): (None, None, -1.485558836, -19.31802269 + 64.79395995j, -448.62),
}


@pytest.fixture
def condition():
    standard = flight_condition(0.0, "airspeed", 50.0)
    air = replace(standard.air, density=np.array(1.225))
    return replace(standard, air=air, dynamic_pressure=np.array(0.5 * 1.225 * 50.0**2))


def model_at(condition, name, damping, virtual_inertia=False):
    system = getattr(examples, name)()
    options = {"damping": damping, "virtual_inertia": virtual_inertia}
    system = replace(system, aerodynamics=replace(system.aerodynamics, **options))
    return linearise(system, condition, trim(system, condition, examples.WIND_TUNNEL_TRIM))


@pytest.mark.parametrize("case", EIGENVALUES, ids=str)
def test_eigenvalues_of_the_data_sets(case, condition):
    values = np.linalg.eigvals(model_at(condition, *case).A)
    upper = np.sort_complex(values[values.imag > 0])
    expected = np.sort_complex(np.array(EIGENVALUES[case]))
    # Parts are printed to ten digits each, small real parts too: compare both parts.
    np.testing.assert_allclose(upper.real, expected.real, rtol=1e-8)
    np.testing.assert_allclose(upper.imag, expected.imag, rtol=1e-8)


@pytest.mark.parametrize("case", SERVO, ids=str)
def test_servo_tab_of_the_data_sets(case, condition):
    servo = servo_tab(model_at(condition, *case))
    numerator, denominator, gain, pole, zero = SERVO[case]
    if numerator is not None:
        np.testing.assert_allclose(servo.numerator, numerator, rtol=1e-8)
        np.testing.assert_allclose(servo.denominator[1:], denominator, rtol=1e-8)
    assert float(servo.dc_gain) == pytest.approx(gain, rel=1e-9)
    assert float(servo.zero) == pytest.approx(zero, rel=1e-5)
    found = np.roots(servo.denominator)[0]
    assert complex(found.real, abs(found.imag)) == pytest.approx(pole, rel=1e-8)
    assert float(servo.natural_frequency) == pytest.approx(abs(pole), rel=1e-8)
    assert float(servo.damping_ratio) == pytest.approx(-pole.real / abs(pole), rel=1e-8)


def test_state_matrix_of_data_set_a(condition):
    # Printed to eight digits.
    A = model_at(condition, "wind_tunnel", "thesis").A
    np.testing.assert_allclose(A[1], [4699.9693, 0.56399632, 5400.2239, 20.328085], rtol=1e-7)
    np.testing.assert_allclose(A[3], [-7370.4668, -0.88445601, -6214.637, -29.985063], rtol=1e-7)
