from dataclasses import replace

import numpy as np
import pytest

from model import examples
from model.flight import flight_condition
from model.linearise import linearise
from model.section import Body, Geometry, Inertia
from model.servo_scaling import ASSUMPTIONS, MeasuredServo, SectionSize, same_structure, scale_servo
from model.servo_tab import servo_tab
from model.trim import trim

REQUEST = examples.WIND_TUNNEL_TRIM


def servo_of(system, condition):
    return servo_tab(linearise(system, condition, trim(system, condition, REQUEST)))


def measured(system, condition):
    servo = servo_of(system, condition)
    return MeasuredServo(servo.natural_frequency, servo.damping_ratio, servo.dc_gain)


def size_of(system):
    return SectionSize(system.geometry.chord, system.geometry.span, float(system.inertia_matrix[1, 1]))


def enlarged(system, length, span, mass):
    """The same shape `length` times as long, `span` times as wide, masses times `mass`."""

    def body(old):
        return Body(old.mass * mass, old.cg_offset * length, old.inertia * mass * length**2)

    g = system.geometry
    geometry = Geometry(g.chord * length, g.span * span, g.aileron_hinge, g.tab_hinge)
    return replace(system, geometry=geometry, inertia=Inertia(body(system.inertia.aileron), body(system.inertia.tab)))


@pytest.mark.parametrize("options", [{}, {"damping": "quasi_steady"}, {"compressibility": "prandtl_glauert"}])
@pytest.mark.parametrize(("length", "span", "mass"), [(5.0, 3.5, 60.0), (0.3, 1.0, 0.05), (1.0, 1.0, 1.0)])
def test_scaled_model_is_the_model_of_the_scaled_section(variant, options, length, span, mass):
    small = variant(examples.wind_tunnel(), **options)
    large = enlarged(small, length, span, mass)
    tunnel, flight = flight_condition(0.0, "airspeed", 50.0), flight_condition(9000.0, "mach", np.array([0.3, 0.6]))
    found = scale_servo(
        measured(small, tunnel), size_of(small), tunnel, size_of(large), flight, "compressibility" in options
    )
    truth = servo_of(large, flight)
    np.testing.assert_allclose(found.servo.natural_frequency, truth.natural_frequency, rtol=1e-12)
    np.testing.assert_allclose(found.servo.damping_ratio, truth.damping_ratio, rtol=1e-12)
    np.testing.assert_allclose(found.servo.gain, truth.dc_gain, rtol=1e-12)
    np.testing.assert_allclose(
        found.reduced_frequency, truth.natural_frequency * large.geometry.chord / (2 * flight.airspeed), rtol=1e-12
    )


def test_the_same_structure_keeps_damping_ratio_and_slows_down_with_size():
    # J ~ c^4 s: omega_n ~ V sqrt(rho) / c, zeta ~ sqrt(rho), reduced frequency unchanged in the same air.
    system = examples.wind_tunnel()
    size, air = size_of(system), flight_condition(0.0, "airspeed", 50.0)
    found = scale_servo(measured(system, air), size, air, same_structure(size, 3.0, 2.8), air)
    assert float(found.frequency_factor) == pytest.approx(0.6 / 3.0, rel=1e-12)
    assert float(found.damping_factor) == pytest.approx(1.0, rel=1e-12)
    same = enlarged(system, 5.0, 3.5, 5.0**2 * 3.5)
    assert float(same_structure(size, 3.0, 2.8).inertia) == pytest.approx(float(same.inertia_matrix[1, 1]), rel=1e-12)


def test_assumptions_are_stated():
    system, air = examples.wind_tunnel(), flight_condition(0.0, "airspeed", 50.0)
    plain = scale_servo(measured(system, air), size_of(system), air, size_of(system), air)
    assert plain.assumptions == (*ASSUMPTIONS, "compressibility is neglected")
    corrected = scale_servo(measured(system, air), size_of(system), air, size_of(system), air, True)
    assert "Prandtl-Glauert" in corrected.assumptions[-1]
    with pytest.raises(ValueError, match="Mach"):
        scale_servo(
            measured(system, air), size_of(system), air, size_of(system), flight_condition(0.0, "mach", 1.1), True
        )


def test_batched_equals_single():
    system, tunnel = examples.wind_tunnel(), flight_condition(0.0, "airspeed", 50.0)
    flight = flight_condition(np.array([0.0, 3000.0, 9000.0]), "airspeed", np.array([[30.0], [90.0]]))
    new = SectionSize(3.0, 2.8, 1.4)
    batch = scale_servo(measured(system, tunnel), size_of(system), tunnel, new, flight)
    assert batch.servo.gain.shape == (2, 3)
    for index in np.ndindex(2, 3):
        single = scale_servo(measured(system, tunnel), size_of(system), tunnel, new, flight.take(index))
        np.testing.assert_allclose(batch.take(index).servo.damping_ratio, single.servo.damping_ratio, rtol=1e-14)
        np.testing.assert_allclose(batch.take(index).reduced_frequency, single.reduced_frequency, rtol=1e-14)


@pytest.mark.parametrize("values", [(0.0, 1.0, 1.0), (1.0, -1.0, 1.0), (1.0, 1.0, np.nan)])
def test_impossible_sizes_are_refused(values):
    with pytest.raises(ValueError, match="positive and finite"):
        SectionSize(*values)
