"""Demands of manoeuvres against those of steps, an ODE solver's integrals, dense samples and energy identities."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp
from scipy.linalg import expm

from design.delay.with_pade import without_delay
from design.manoeuvre import doublet, ramp, rate_limited_step, recorded, sine, step
from design.response.demand import ActuatorDemand, actuator_demands, envelope_demand
from design.response.manoeuvre_demand import manoeuvre_demands, tracking_errors
from design.response.manoeuvre_response import manoeuvre_response
from design.response.needed_bandwidth import SHARE, needed_bandwidths
from design.response.step_response import step_response
from model.actuators import ActuatorLimits
from tests.design.delay.delayed_loops import tab_only
from tests.design.step_loops import data_set_a, loop, random_stable, second_order, servo_and_aileron

SIZE = np.array([np.deg2rad(10.0)])
BOTH = ("tab", "aileron")
FREE = (ActuatorLimits(), ActuatorLimits())
STEPPED = tuple(field.name for field in fields(ActuatorDemand))
LIMITS = ("deflection", "rate", "torque", "power")


def noise(seed: int, count: int, spacing: float):
    return recorded(np.arange(count) * spacing, 0.1 * np.random.default_rng(seed).normal(size=(count, 1)))


MANOEUVRES = {
    "rate-limited step": rate_limited_step(SIZE, 0.9),
    "ramp": ramp(SIZE),
    "doublet": doublet(SIZE, 0.13),
    "sine": sine(SIZE, 30.0),
    "series": noise(1, 40, 0.013),
    "series that jumps": recorded(np.array([0, 0.2, 0.2, 0.45]), np.array([[0.1], [0.3], [0.0], [-0.2]])),
}


def signals_of(response, i, letter):
    """Torque, rate, deflection, acceleration and power at the samples of point i."""
    torque, rate, angle = (
        response.outputs[i, :, response.index(n)] for n in (f"T_{letter}", f"d{letter}_rate", f"d{letter}")
    )
    return torque, rate, angle, torque * rate


@pytest.mark.parametrize(
    ("loops", "duration"),
    [
        (data_set_a(np.array([20.0, 50.0])), 1.0),
        (random_stable(41, 3), 2.0),
        (random_stable(42, 2), 0.3),
        (servo_and_aileron(6e3, 0.7, 5.0, 0.4).take(None), 10.0),
    ],
)
def test_a_step_asks_for_what_steps_do(loops, duration: float) -> None:
    """Also at the points of a grid that are kept, and of a step that is a series held for ever."""
    expected = actuator_demands(loops, step_response(loops, SIZE, duration), BOTH)
    for manoeuvre in (step(SIZE), recorded(np.zeros(1), SIZE[None])):
        found = manoeuvre_demands(loops, manoeuvre_response(loops, manoeuvre, duration), BOTH, FREE)
        for ours, theirs in zip(found, expected, strict=True):
            for name in STEPPED:
                size = np.max(theirs.energy_out + theirs.energy_back) if "energy" in name else 0.0
                np.testing.assert_allclose(
                    getattr(ours, name), getattr(theirs, name), rtol=1e-8, atol=1e-8 * size + 1e-14, err_msg=name
                )


@pytest.mark.parametrize("name", MANOEUVRES)
def test_integrals_and_times_are_those_of_an_ode_solver(name: str) -> None:
    """Every stretch is integrated by itself, the integrals among its states."""
    loops, duration = data_set_a(np.array([35.0])), 0.5
    response = manoeuvre_response(loops, MANOEUVRES[name], duration, 2)
    found = manoeuvre_demands(loops, response, BOTH, FREE)
    M, at = response.generator[0], response.driven.stretches
    n = M.shape[0]
    for letter, demand in zip("ta", found, strict=True):
        torque, rate = (response.rows[0, response.index(each)] for each in (f"T_{letter}", f"d{letter}_rate"))

        def slope(t, y, torque=torque, rate=rate):
            push = torque @ y[:n]
            power = push * (rate @ y[:n])
            return np.concatenate([M @ y[:n], [push**2, power**2, max(power, 0.0), max(-power, 0.0)]])

        y = np.zeros(n + 4)
        for length, driving in zip(at.lengths, response.driven.driving, strict=True):
            y[n - len(driving) : n] = driving
            y = solve_ivp(slope, (0.0, length), y, "DOP853", rtol=1e-12, atol=1e-15, max_step=1e-3).y[:, -1]
        mean = np.sqrt(y[n : n + 2] / duration)
        np.testing.assert_allclose([demand.rms_torque[0], demand.rms_power[0]], mean, rtol=1e-8)
        energies = [demand.energy_out[0], demand.energy_back[0]]
        np.testing.assert_allclose(energies, y[n + 2 :], atol=2e-8 * y[n + 2 :].max())


@pytest.mark.parametrize("name", MANOEUVRES)
@pytest.mark.parametrize("loops", [data_set_a(np.array([45.0])), random_stable(51, 1)])
def test_times_at_limits_are_those_of_dense_samples(loops, name: str) -> None:
    duration, samples = 0.5, 200_001
    dense = manoeuvre_response(loops, MANOEUVRES[name], duration, samples)
    for part in (0.3, 0.8, 0.97):
        limits = []
        for letter in "ta":
            torque, rate, angle, power = (part * np.abs(s).max() for s in signals_of(dense, 0, letter))
            limits.append(ActuatorLimits(angle, rate, torque, power))
        found = manoeuvre_demands(loops, dense, BOTH, tuple(limits))
        for letter, demand, limit in zip("ta", found, limits, strict=True):
            torque, rate, angle, power = (np.abs(s) for s in signals_of(dense, 0, letter))
            for what, signal in zip(LIMITS, (angle, rate, torque, power), strict=True):
                beyond = np.mean(signal >= getattr(limit, what)) * duration
                spent = getattr(demand, f"time_at_{what}_limit")[0]
                assert abs(spent - beyond) < 60 * duration / samples, (what, part)


def test_a_peak_between_two_samples_is_time_at_a_limit() -> None:
    """A limit so near the peak that no sample of the mesh reaches it, in closed form."""
    w, z = 25.0, 0.4
    wd = w * np.sqrt(1.0 - z**2)
    one = second_order(w, z)
    top = SIZE[0] * (1.0 + np.exp(-np.pi * z * w / wd))
    for below in (1e-4, 1e-5, 1e-7):
        limits = (ActuatorLimits(deflection=top * (1.0 - below)),)
        response = manoeuvre_response(one, step(SIZE), 1.0)
        found = manoeuvre_demands(one, response, ("aileron",), limits)[0].time_at_deflection_limit
        # About the peak the course is a parabola whose curvature is that of the torque.
        curvature = SIZE[0] * w**2 * np.exp(-np.pi * z * w / wd)
        np.testing.assert_allclose(found, 2.0 * np.sqrt(2.0 * below * top / curvature), rtol=2e-2)
    beyond = (ActuatorLimits(deflection=top * (1.0 + 1e-7)),)
    assert manoeuvre_demands(one, response, ("aileron",), beyond)[0].time_at_deflection_limit == 0.0


def test_a_dip_between_two_samples_is_no_time_at_a_limit() -> None:
    w, z = 25.0, 0.1
    wd = w * np.sqrt(1.0 - z**2)
    one = second_order(w, z)
    dip = SIZE[0] * (1.0 - np.exp(-2.0 * np.pi * z * w / wd))
    response = manoeuvre_response(one, step(SIZE), 0.32)
    found = [
        manoeuvre_demands(one, response, ("aileron",), (ActuatorLimits(deflection=dip * (1.0 + part)),))[0]
        for part in (-1e-7, 1e-7)
    ]
    lost = found[0].time_at_deflection_limit - found[1].time_at_deflection_limit
    curvature = SIZE[0] * w**2 * np.exp(-2.0 * np.pi * z * w / wd)
    np.testing.assert_allclose(lost, 2.0 * np.sqrt(2e-7 * dip / curvature), rtol=2e-2)


def test_a_limit_that_is_absent_has_no_time_and_sets_no_requirement() -> None:
    loops = data_set_a(np.array([20.0, 30.0]))
    response = manoeuvre_response(loops, MANOEUVRES["doublet"], 0.5)
    tab, aileron = manoeuvre_demands(loops, response, BOTH, (ActuatorLimits(rate=0.1), ActuatorLimits(torque=1e9)))
    assert np.all(tab.time_at_rate_limit > 0.0)
    assert np.isnan([tab.time_at_torque_limit, aileron.time_at_rate_limit]).all()
    np.testing.assert_array_equal(aileron.time_at_torque_limit, 0.0)
    envelope = envelope_demand("tab", tab, np.ones(2, dtype=bool))
    assert envelope.requirement("time_at_torque_limit").value is None
    assert envelope.requirement("time_at_rate_limit").value == tab.time_at_rate_limit.max()
    assert envelope.requirement("peak_rate").value == tab.peak_rate.max()


@pytest.mark.parametrize("name", MANOEUVRES)
def test_peaks_are_those_of_dense_samples(name: str) -> None:
    loops, duration = data_set_a(np.array([50.0])), 0.5
    response = manoeuvre_response(loops, MANOEUVRES[name], duration, 100_001)
    for letter, demand in zip("ta", manoeuvre_demands(loops, response, BOTH, FREE), strict=True):
        for what, signal in zip(
            ("torque", "rate", "deflection", "power"), signals_of(response, 0, letter), strict=True
        ):
            found, sampled = getattr(demand, f"peak_{what}")[0], np.abs(signal).max()
            assert found >= sampled * (1.0 - 1e-9)
            if what in ("rate", "deflection"):  # these do not jump
                np.testing.assert_allclose(found, sampled, rtol=1e-6)


def test_acceleration_holds_what_the_reference_does() -> None:
    """An aileron that its reference moves by its rate: ``da_rate = r' + x``, whose own rate is x' between knots."""
    one = loop(
        A=[[-5.0]], B=[[1.0]], E=[[0.0]], K=[[0.0]], N=[[1.0]], C=[[1.0], [1.0], [0.0]], F=[[0.0], [1.0], [1.0]],
        D=np.zeros((3, 1)), offset=np.zeros(3), outputs=("T_a", "da_rate", "da"),
    )  # fmt: skip
    omega = 3.0
    response = manoeuvre_response(one, sine(np.ones(1), omega), 4.0, 40_001)
    found = manoeuvre_demands(one, response, ("aileron",), (ActuatorLimits(),))[0]
    rate = response.outputs[:, response.index("da_rate")]
    # The sine starts with a kink of x', so its rate jumps there only if it sees it: here it does not.
    np.testing.assert_allclose(found.peak_acceleration, np.abs(np.gradient(rate, 1e-4)).max(), rtol=1e-3)


def test_net_work_is_the_change_of_kinetic_energy() -> None:
    """A unit inertia that nothing else pushes: what is put in and not taken back is half the square of its rate."""
    one = second_order(np.array([10.0, 25.0]), 0.4)
    for name, manoeuvre in MANOEUVRES.items():
        response = manoeuvre_response(one, manoeuvre, 0.37)
        found = manoeuvre_demands(one, response, ("aileron",), (ActuatorLimits(),))[0]
        rate = response.outputs[..., -1, response.index("da_rate")]
        size = found.energy_out + found.energy_back
        np.testing.assert_array_less(np.abs(found.energy_out - found.energy_back - 0.5 * rate**2), 1e-8 * size, name)


def test_jumps_at_later_knots_ask_for_what_no_actuator_has() -> None:
    def seen(rows):
        return loop(
            A=[[-5.0]], B=[[1.0]], E=[[0.0]], K=[[0.0]], N=[[1.0]], C=[[1.0], [1.0], [1.0]], F=np.zeros((3, 1)),
            D=np.reshape(rows, (3, 1)), offset=np.zeros(3), outputs=("T_a", "da_rate", "da"),
        )  # fmt: skip

    smooth_then_jump = recorded(np.array([0.0, 0.2, 0.2]), np.array([[0.0], [0.1], [0.0]]))
    smooth = recorded(np.array([0.0, 0.2, 0.4]), np.array([[0.0], [0.1], [0.0]]))

    def demand(rows, manoeuvre, duration=1.0):
        one = seen(rows)
        return manoeuvre_demands(one, manoeuvre_response(one, manoeuvre, duration), ("aileron",), (ActuatorLimits(),))[
            0
        ]

    assert np.isinf(demand([0, 1, 0], smooth_then_jump).peak_acceleration)
    assert np.isfinite(demand([0, 1, 0], smooth).peak_acceleration)
    assert np.isfinite(demand([0, 1, 0], smooth_then_jump, 0.2).peak_acceleration), "the knot is not flown"
    angle = demand([0, 0, 1], smooth_then_jump)
    assert np.isinf([angle.peak_rate, angle.peak_power, angle.peak_acceleration]).all()
    assert np.isfinite(demand([0, 0, 1], smooth).peak_rate)


def test_an_impulse_of_torque_is_no_torque_that_a_motor_has() -> None:
    """A torque that takes v' is struck where the feed-forward jumps, and finite where it bends."""
    loops = random_stable(61, 2)
    H = np.zeros_like(loops.D)
    H[..., loops.outputs.index("T_t"), 0] = 0.1
    loops = replace(loops, H=H)

    def demand(manoeuvre):
        return manoeuvre_demands(loops, manoeuvre_response(loops, manoeuvre, 0.5), BOTH, FREE)

    tab, aileron = demand(MANOEUVRES["doublet"])
    assert np.isinf([tab.peak_torque, tab.rms_torque, tab.peak_power, tab.rms_power]).all()
    assert np.isnan([tab.energy_out, tab.energy_back]).all()
    assert np.isfinite([aileron.peak_torque, aileron.energy_out]).all()
    assert np.isfinite([demand(MANOEUVRES["ramp"])[0].peak_torque]).all()


def test_a_torque_that_is_not_finite_is_unlimited() -> None:
    one = data_set_a(np.array([20.0]))
    kept = [i for i, name in enumerate(one.outputs) if name != "T_t"]
    rows = {name: getattr(one, name)[..., kept, :] for name in ("C", "F", "D", "H")}
    without = replace(one, **rows, offset=one.offset[..., kept], outputs=tuple(one.outputs[i] for i in kept))
    limits = (ActuatorLimits(0.1, 0.1, 0.1, 0.1),)
    found = manoeuvre_demands(without, manoeuvre_response(without, MANOEUVRES["doublet"], 0.5), ("tab",), limits)[0]
    assert np.isinf([found.peak_torque, found.peak_power]).all()
    assert np.isnan([found.time_at_torque_limit, found.time_at_power_limit, found.energy_out]).all()
    assert np.isfinite([found.time_at_rate_limit, found.time_at_deflection_limit]).all()


@pytest.mark.parametrize("name", MANOEUVRES)
def test_a_grid_is_its_points(name: str) -> None:
    loops = data_set_a(np.array([[20.0, 30.0], [25.0, 50.0]]))
    limits = (ActuatorLimits(0.02, 0.5, 0.05, 0.02), ActuatorLimits(0.1, 2.0, 1.0, 2.0))
    grid = manoeuvre_demands(loops, manoeuvre_response(loops, MANOEUVRES[name], 0.5), BOTH, limits)
    errors = tracking_errors(loops, manoeuvre_response(loops, MANOEUVRES[name], 0.5))
    for index in np.ndindex(2, 2):
        point = loops.take(index)
        response = manoeuvre_response(point, MANOEUVRES[name], 0.5)
        for over, at in zip(grid, manoeuvre_demands(point, response, BOTH, limits), strict=True):
            for field in fields(at):
                np.testing.assert_allclose(
                    getattr(over, field.name)[index], getattr(at, field.name), rtol=1e-8, atol=1e-10, err_msg=field.name
                )
        alone = tracking_errors(point, response)
        np.testing.assert_allclose(errors.peak[index], alone.peak, rtol=1e-9)
        np.testing.assert_allclose(errors.rms[index], alone.rms, rtol=1e-9)


def test_a_point_that_overflows_leaves_the_others_alone() -> None:
    loops = second_order(np.array([30.0, 30.0]), np.array([0.5, -0.9]))
    limits = (ActuatorLimits(0.1, 1.0, 10.0, 10.0),)
    found = manoeuvre_demands(loops, manoeuvre_response(loops, doublet(SIZE, 30.0), 100.0), ("aileron",), limits)[0]
    alone = loops.take(0)
    peer = manoeuvre_demands(alone, manoeuvre_response(alone, doublet(SIZE, 30.0), 100.0), ("aileron",), limits)[0]
    for field in fields(found):
        np.testing.assert_allclose(getattr(found, field.name)[0], getattr(peer, field.name), rtol=1e-7, atol=1e-9)
    assert not np.isfinite(found.peak_torque[1])
    assert np.isnan([found.time_at_torque_limit[1], found.holding_torque[1], found.needed_bandwidth[1]]).all()


def test_tracking_error_is_the_reference_less_the_angle() -> None:
    loops, duration = data_set_a(np.array([25.0, 40.0])), 0.5
    loops = replace(loops, offset=loops.offset + 0.03)  # a trim angle is no error
    for name, manoeuvre in MANOEUVRES.items():
        response = manoeuvre_response(loops, manoeuvre, duration, 50_001)
        found = tracking_errors(loops, response)
        at = response.index("da")
        error = response.references[..., 0] - (response.outputs[..., at] - loops.offset[..., at, None])
        jumps = np.abs(manoeuvre.jumps[manoeuvre.times < duration]).max()
        np.testing.assert_allclose(found.peak[:, 0], np.abs(error).max(axis=-1), rtol=1e-3 if jumps else 1e-5)
        np.testing.assert_allclose(found.rms[:, 0], np.sqrt(np.mean(error**2, axis=-1)), rtol=1e-3, err_msg=name)
    held = tracking_errors(loops, manoeuvre_response(loops, step(SIZE), duration))
    np.testing.assert_allclose(held.peak, SIZE[0], rtol=1e-12)


def test_the_needed_bandwidth_holds_its_share_of_the_squared_rate() -> None:
    loops = random_stable(71, 3)
    found = needed_bandwidths(loops, BOTH)
    for i in range(3):
        for k, name in enumerate(("dt", "da")):
            row = loops.closed_outputs[i, loops.outputs.index(name)]

            def square(w, i=i, row=row):
                state = np.linalg.solve(1j * w * np.eye(5) - loops.closed[i], loops.reference_input[i, :, 0])
                return abs(row @ state) ** 2

            below, whole = (quad(square, 0.0, end, limit=400, epsrel=1e-9)[0] for end in (found[i, k], np.inf))
            np.testing.assert_allclose(below / whole, SHARE, rtol=1e-6)


def test_the_needed_bandwidth_of_equal_poles() -> None:
    """``(w / (s + w))^3`` as a chain, whose eigenvectors are all the same: quad again."""
    w = 7.0
    A = -w * np.eye(3) + w * np.eye(3, k=-1)
    one = loop(
        A=A, B=np.zeros((3, 1)), E=[[w], [0.0], [0.0]], K=np.zeros((1, 3)), N=[[0.0]], C=np.eye(3),
        F=np.zeros((3, 3)), D=np.zeros((3, 1)), offset=np.zeros(3), outputs=("x", "da_rate", "da"),
    )  # fmt: skip
    found = float(needed_bandwidths(one, ("aileron",))[0])
    below, whole = (quad(lambda v: (1.0 + (v / w) ** 2) ** -3, 0.0, end, epsrel=1e-12)[0] for end in (found, np.inf))
    np.testing.assert_allclose(below / whole, SHARE, rtol=1e-4)


def test_the_needed_bandwidth_where_there_is_none() -> None:
    stable, unstable = (second_order(np.array([10.0]), z) for z in (0.5, -0.5))
    assert np.isnan(needed_bandwidths(unstable, ("aileron",))).all()
    still = replace(stable, N=0.0 * stable.N)
    assert np.isnan(needed_bandwidths(still, ("aileron",))).all()
    through = replace(stable, D=stable.D + np.array([[1.0], [0.0], [0.0]]))
    assert np.isinf(needed_bandwidths(through, ("aileron",))).all()
    np.testing.assert_allclose(
        needed_bandwidths(second_order(20.0, 0.5), ("aileron",)),
        2.0 * needed_bandwidths(stable, ("aileron",))[0],
        rtol=1e-9,
    )
    regulator = replace(stable, E=stable.E[..., :0], N=stable.N[..., :0], references=())
    assert np.isnan(needed_bandwidths(regulator, ("aileron",))).all()


def test_a_delay_is_a_chain_of_states() -> None:
    loops = replace(data_set_a(np.array([20.0, 30.0])), delay=(0.004, 0.004))
    chained = without_delay(loops)
    found, peer = (
        manoeuvre_demands(each, manoeuvre_response(each, MANOEUVRES["series"], 0.5), BOTH, FREE)
        for each in (loops, chained)
    )
    for ours, theirs in zip(found, peer, strict=True):
        for field in fields(ours):
            np.testing.assert_array_equal(getattr(ours, field.name), getattr(theirs, field.name))


def test_the_needed_bandwidth_of_a_loop_with_a_delay(plant_a) -> None:
    """From the exact frequency response, delay and all."""
    loops = tab_only(plant_a, "second_order", 0.005).take((0, slice(0, 2)))
    found = needed_bandwidths(loops, ("tab",))[..., 0]
    row = loops.C[..., loops.outputs.index("dt"), :]  # of the state alone: its servo is of second order
    for i in range(2):
        w = np.concatenate([np.linspace(1e-3, 2e3, 40_001), np.geomspace(2e3, 1e6, 20_001)[1:]])
        back = np.exp(-1j * w * 0.005)[:, None, None] * (loops.B[i] @ loops.K[i])
        state = np.linalg.solve(1j * w[:, None, None] * np.eye(len(loops.states)) - loops.A[i] + back, loops.E[i])
        square = np.abs(state[..., 0] @ row[i]) ** 2
        part = np.concatenate([[0.0], np.cumsum(0.5 * (square[1:] + square[:-1]) * np.diff(w))])
        np.testing.assert_allclose(found[i], np.interp(SHARE * part[-1], part, w), rtol=1e-3)


def test_two_references_have_an_error_each() -> None:
    loops = random_stable(91, 2)
    loops = replace(
        loops, E=np.repeat(loops.E, 2, axis=-1), N=np.repeat(loops.N, 2, axis=-1), references=("r_a", "r_t")
    )
    sizes = np.array([0.2, -0.1])
    response = manoeuvre_response(loops, rate_limited_step(sizes, 0.5), 1.0, 20_001)
    found = tracking_errors(loops, response)
    for p, name in enumerate(("da", "dt")):
        at = response.index(name)
        error = response.references[..., p] - (response.outputs[..., at] - loops.offset[..., at, None])
        np.testing.assert_allclose(found.peak[:, p], np.abs(error).max(axis=-1), rtol=1e-5)
    one = replace(loops, E=loops.E[..., :1], N=loops.N[..., :1], references=("r_a",))
    np.testing.assert_allclose(needed_bandwidths(loops, BOTH), needed_bandwidths(one, BOTH), rtol=1e-9)


def test_limits_are_given_for_each_actuator() -> None:
    one = second_order(10.0, 0.5)
    with pytest.raises(ValueError, match="as many sets of limits"):
        manoeuvre_demands(one, manoeuvre_response(one, step(SIZE), 1.0), ("aileron",), FREE)
    with pytest.raises(ValueError, match="no actuator 'flap'"):
        manoeuvre_demands(one, manoeuvre_response(one, step(SIZE), 1.0), ("flap",), FREE[:1])


def test_expm_finds_the_same_states_on_the_mesh() -> None:
    """The samples that everything is taken of, of all kinds of stretches, one by one."""
    loops = random_stable(81, 2, n=3)
    for manoeuvre in (*MANOEUVRES.values(), noise(5, 40, 0.3), noise(6, 40, 0.05)):
        response = manoeuvre_response(loops, manoeuvre, 1.1)
        identity = np.broadcast_to(np.eye(response.generator.shape[-1]), response.generator.shape)
        x = np.zeros((2, 3))
        k = 0
        for part in response.driven.signals(identity):
            for c in range(part.values.shape[-3]):
                z = np.concatenate([x, np.broadcast_to(response.driven.driving[k], (2, len(identity[0]) - 3))], axis=-1)
                begin = response.driven.stretches.starts[k]
                for s in range(part.values.shape[-2]):
                    for m in (0, 3, part.values.shape[-1] - 1):
                        time = part.starts[c, s] + m * part.steps[c, s] - begin
                        expected = (expm(response.generator * time) @ z[..., None])[..., 0]
                        np.testing.assert_allclose(part.values[:, :, c, s, m], expected, rtol=1e-10, atol=1e-11)
                x = part.values[:, :3, c, -1, -1]
                k += 1
        assert k == len(response.driven.driving)
