"""The scheduled law in motion against simulations of it that know nothing of the linearised loop."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import BarycentricInterpolator
from scipy.linalg import expm

from design.classical.controller import ClassicalController
from design.classical.tab_loop import tab_loop
from design.estimation.rate_filters import with_rate_filters
from design.lqr.flown import flown_loop
from design.lqr.measurement import RateFilters
from design.outcome import Outcome
from model.actuators import Actuator
from model.flight import flight_condition
from model.linear_model import INPUTS
from model.linearise import linearise
from model.motion import acceleration
from model.servo_tab import servo_tab
from model.trim import HeldTorque, TrimRequest, trim
from schedules.hidden_coupling import hidden_coupling
from schedules.interpolate import interpolate
from schedules.moving_loop import why_no_coupling
from schedules.rules import ScheduleRules
from schedules.run import run
from schedules.schedule import Provenance
from schedules.schedule_of import schedule_of
from schedules.slow_ramp import ramp_deviation
from schedules.study import GridRequest, Reference

NOWHERE = Provenance("", "", "", "", "")
H, Q = 0.0, 551.25
FLOATING = TrimRequest(0.1, aileron=HeldTorque("aileron", 0.3), tab=0.02)
LEANING = TrimRequest(0.1, aileron=0.01, tab=HeldTorque("aileron", -0.2))


@pytest.fixture(scope="module")
def moving(wind_tunnel_study):
    """Four controllers whose trim angles move with dynamic pressure, by the name of the trim."""
    nf, pf, lqr = wind_tunnel_study.controllers
    controllers = (
        nf, pf, replace(nf, name="rate", tab_command="rate", rate_filter=None),
        lqr, replace(lqr, name="filtered", measurement=RateFilters(800.0)),
    )  # fmt: skip
    found = {}
    for name, asked in (("floating", FLOATING), ("leaning", LEANING)):
        study = replace(
            wind_tunnel_study, trim=asked, controllers=controllers, reference=Reference(np.deg2rad(3.0), 1.0),
            aileron_actuator=Actuator(torque_loop_bandwidth=300.0),
            grid=GridRequest((H,), "dynamic_pressure", (300.0, Q, 980.0)),
        )  # fmt: skip
        found[name] = (study, run(study))
    return found


def coupling(moving, which, name, lag=0.0, rules=None):
    study, envelope = moving[which]
    designed = envelope.controller(name)
    assert np.all(designed.outcomes.ok), designed.outcomes.reasons
    schedule = schedule_of(envelope, designed, NOWHERE, ScheduleRules() if rules is None else rules)
    return study, envelope, designed, schedule, hidden_coupling(study, envelope.plant, designed, schedule, lag)


def plants(study, envelope, low, high):
    """The plant between two dynamic pressures, as polynomials through trims and linearisations of their own."""
    nodes = 0.5 * (low + high) + 0.5 * (high - low) * np.cos(np.pi * np.arange(9) / 8)
    condition = flight_condition(np.full(9, H), "dynamic_pressure", nodes)
    system = envelope.plant.system
    model = linearise(system, condition, trim(system, condition, study.trim))
    servo = servo_tab(model)

    def smooth(values):
        return BarycentricInterpolator(nodes, values)

    return (smooth(model.state_offset), smooth(model.input_offset), smooth(servo.F), smooth(servo.G))


def gains_at(schedule, q):
    return {gain.name: float(gain.values) for gain in interpolate(schedule, (H, q)).gains}


def by_slope(schedule, side):
    """Gains as straight lines through the point and its neighbour below or above."""
    here, there = gains_at(schedule, Q), gains_at(schedule, schedule.axes[1].values[2 * side])
    width = schedule.axes[1].values[2 * side] - Q
    return lambda q: {name: here[name] + (q - Q) / width * (there[name] - here[name]) for name in here}


def classical_flight(study, envelope, designed, schedule, course, lag, placement, side):
    """Right-hand side of the law as it stands in words, in totals, and its states at rest."""
    request, w_d = designed.request, study.tab_actuator
    X0, _, F, G = plants(study, envelope, 0.8 * Q, 1.2 * Q)
    tables = by_slope(schedule, side)
    r, sigma, rate = study.reference.aileron, -1.0, request.tab_command == "rate"

    def law(q, x):
        dt, dt_rate, da, da_rate, stored, filtered, read = x
        k, (dt0, _, da0, _) = tables(read), X0(read)
        before = placement == "before_gain"
        command = k["K_i"] * stored if before else stored
        if "K_f" in k:
            command += k["K_f"] * (da - da0)
        else:
            slope = da_rate if request.rate_filter is None else request.rate_filter * (da - filtered)
            command -= k["K_p"] * (da - da0) + k["K_d"] * slope
        command = dt0 + sigma * command
        error = r - (da - da0)
        if rate:
            w = w_d.rate_loop_bandwidth
            tab = w * (k["K_theta"] * (command - dt) - dt_rate)
        else:
            w = w_d.servo_bandwidth
            tab = w**2 * (command - dt) - 2.0 * w_d.servo_damping_ratio * w * dt_rate
        trimmed = X0(q)
        aileron = F(q)[1] @ [da - trimmed[2], da_rate] + G(q)[1] @ [dt - trimmed[0], dt_rate]
        follow = 0.0 if request.rate_filter is None else request.rate_filter * (da - filtered)
        moved = (q - read) / lag if lag else 0.0
        return np.array([dt_rate, tab, da_rate, aileron, error if before else k["K_i"] * error, follow, moved])

    def derivative(t, x):
        q = course(t)
        return law(q, x if lag else np.append(x[:-1], q))

    trimmed, k = X0(Q), tables(Q)
    dt = -F(Q)[1, 0] * r / G(Q)[1, 0]
    stored = sigma * dt + (k["K_p"] * r if "K_p" in k else -k["K_f"] * r)
    stored = stored / k["K_i"] if placement == "before_gain" else stored
    rest = np.array([trimmed[0] + dt, 0.0, trimmed[2] + r, 0.0, stored, trimmed[2] + r, Q])
    return derivative, rest, (0, 1, 2, 3), lambda q: X0(q)[..., 2] + r, ("dt", "dt_rate", "da", "da_rate")


def lqr_flight(study, envelope, designed, schedule, course, lag, placement, side):
    """The same of both torques around the non-linear equations of motion."""
    system, w = envelope.plant.system, study.aileron_actuator.torque_loop_bandwidth
    X0, U0, _, _ = plants(study, envelope, 0.8 * Q, 1.2 * Q)
    tables, r = by_slope(schedule, side), study.reference.aileron
    cutoff = designed.request.measurement.cutoff if designed.request.measurement else None

    def derivative(t, x):
        q = course(t)
        motion, torque, stored, filtered, read = x[:4], x[4], x[5:7], x[7:9], x[9] if lag else q
        k, x0, u0 = tables(read), X0(read), U0(read)
        K = np.array([[k[f"K_{u}_{s}"] for s in ("dt", "dt_rate", "da", "da_rate")] for u in INPUTS])
        K_i, K_t = (np.array([k[f"K_{u}_{s}"] for u in INPUTS]) for s in ("int_a", "aileron_torque"))
        error = r - (motion[2] - x0[2])
        before = placement == "before_gain"
        seen, follow = motion - x0, np.zeros(2)
        if cutoff:
            follow = cutoff * (motion[[0, 2]] - filtered)
            seen[1], seen[3] = follow
        u = u0 - K @ seen - K_t * (torque - u0[1]) - (K_i * stored[0] if before else stored)
        u = u + np.array([k[f"N_{i}_r_a"] for i in INPUTS]) * r
        turned = acceleration(
            system, flight_condition(H, "dynamic_pressure", q), study.trim.alpha, motion, np.array([u[0], torque])
        )
        integral = [error, 0.0] if before else K_i * error
        moved = (q - x[9]) / lag if lag else 0.0
        return np.array([motion[1], turned[0], motion[3], turned[1], w * (u[1] - torque), *integral, *follow, moved])

    def resting(y):
        x = np.array([y[0], 0.0, X0(Q)[2] + r, 0.0, y[1], 0.0, 0.0, y[0], X0(Q)[2] + r, Q])
        k = tables(Q)
        x[5:7] = [y[2], 0.0] if placement == "before_gain" else [k[f"K_{u}_int_a"] * y[2] for u in INPUTS]
        return x

    y = np.array([X0(Q)[0], U0(Q)[1], 0.0])
    for _ in range(6):  # Newton's method for where it rests

        def off(y):
            return derivative(0.0, resting(y))[[1, 3, 4]]

        jacobian = np.stack([(off(y + d) - off(y - d)) / 2e-4 for d in 1e-4 * np.eye(3)], axis=-1)
        y = y - np.linalg.solve(jacobian, off(y))
    assert np.max(np.abs(off(y))) < 1e-7
    return derivative, resting(y), (0, 1, 2, 3), lambda q: X0(q)[..., 2] + r, ("dt", "dt_rate", "da", "da_rate")


def flight(designed):
    return classical_flight if isinstance(designed.request, ClassicalController) else lqr_flight


def flown(derivative, rest, times):
    found = solve_ivp(
        derivative, (0.0, times[-1]), rest, method="LSODA", t_eval=times, rtol=1e-10, atol=1e-13, max_step=0.02
    )
    assert found.success
    return found.y


CASES = [
    ("floating", "nf", 0.0, "before_gain", 1), ("floating", "nf", 0.02, "after_gain", 1),
    ("leaning", "pf", 0.0, "after_gain", 0), ("leaning", "pf", 0.05, "before_gain", 1),
    ("floating", "rate", 0.02, "after_gain", 0), ("leaning", "rate", 0.0, "before_gain", 1),
    ("floating", "lqr", 0.0, "before_gain", 1), ("leaning", "lqr", 0.03, "after_gain", 0),
    ("floating", "filtered", 0.02, "before_gain", 0),
]  # fmt: skip


@pytest.mark.parametrize(("which", "name", "lag", "placement", "side"), CASES)
def test_a_ramp_drives_the_aileron_away_as_simulated(moving, which, name, lag, placement, side):
    """Largest and last deviation in a slow ramp, of the law in totals with q varying inside it."""
    study, envelope, designed, schedule, found = coupling(moving, which, name, lag)
    rate = 0.4 if side else -0.4
    derivative, rest, _, wanted, names = flight(designed)(
        study, envelope, designed, schedule, lambda t: Q + rate * t, lag, placement, side
    )
    times = np.linspace(0.0, 1.2, 601)
    x = flown(derivative, rest, times)
    off = (x[names.index("da")] - wanted(Q + rate * times)) / rate
    said = found.placed[placement]
    assert said.settled[0, 1, side] == pytest.approx(off[-1], rel=5e-3, abs=2e-3 * np.max(np.abs(off)))
    assert said.peak[0, 1, side] == pytest.approx(np.max(np.abs(off)), rel=5e-3)
    assert said.peak[0, 1, side] > 1e-7  # the case has something to show


@pytest.mark.parametrize(("which", "name", "lag", "placement", "side"), CASES)
def test_the_linearised_loop_answers_its_scheduling_variable_as_simulated(moving, which, name, lag, placement, side):
    """All four angles and rates while q swings to one side: input A, B of totals against the law in motion."""
    study, envelope, designed, schedule, found = coupling(moving, which, name, lag)
    size, w = (0.5 if side else -0.5), 25.0

    def course(t):
        return Q + size * (1.0 - np.cos(w * t))

    derivative, rest, at, _, names = flight(designed)(study, envelope, designed, schedule, course, lag, placement, side)
    times = np.linspace(0.0, 0.4, 201)
    x = flown(derivative, rest, times)
    said = found.placed[placement]
    A, B = said.A[0, 1, side], said.B[0, 1, side]
    n = len(A)
    # [z, 1, cos, sin]: 1 - cos drives.
    whole = np.zeros((n + 3, n + 3))
    whole[:n, :n], whole[:n, n], whole[:n, n + 1] = A, size * B, -size * B
    whole[n + 1, n + 2], whole[n + 2, n + 1] = -w, w
    begin = np.zeros(n + 3)
    begin[n], begin[n + 1] = 1.0, 1.0
    step = expm(whole * times[1])
    course_of = [begin]
    for _ in times[1:]:
        course_of.append(step @ course_of[-1])
    expected = np.array(course_of)
    for k, state in zip(at, names, strict=True):
        mine = expected[:, found.states.index(state)]
        actual = x[k] - x[k, 0]
        assert np.max(np.abs(mine - actual)) < 1e-2 * np.max(np.abs(actual)), state


def frozen_loop(study, envelope, designed, schedule, q, placement, side):
    """Acl at q, trimmed and assembled anew; after the gain in the coordinates of what is stored there."""
    system, request = envelope.plant.system, designed.request
    condition = flight_condition(np.array([H]), "dynamic_pressure", np.array([q]))
    model = linearise(system, condition, trim(system, condition, study.trim))
    gains = {name: np.array([value]) for name, value in by_slope(schedule, side)(q).items()}
    if isinstance(request, ClassicalController):
        loop = tab_loop(model, servo_tab(model), study.tab_actuator, request, gains)
        K_i = gains["K_i"][:, None]
    else:
        structure = request.structure(study.tab_actuator, study.aileron_actuator)
        names = structure.states(model.states)
        K = np.stack([np.stack([gains[f"K_{u}_{s}"] for s in names], axis=-1) for u in INPUTS], axis=-2)
        loop = flown_loop(model, structure, K, np.zeros((1, 2, 1)))
        if request.measurement:
            loop = with_rate_filters(loop, request.measurement.cutoff)
        K_i = K[..., names.index("int_a")]
    A = loop.closed[0]
    if placement == "before_gain":
        return A, loop.states
    i = loop.states.index("int_a")
    others = [k for k in range(len(A)) if k != i]
    if len(K_i[0]) == 1:
        stored = np.zeros((len(A), len(A)))
        stored[np.ix_(others, others)] = A[np.ix_(others, others)]
        stored[others, i], stored[i, others] = A[others, i] / K_i[0, 0], A[i, others] * K_i[0, 0]
        return stored, loop.states
    # Two torques: one stored command each, at the place of the integral and behind all.
    n = len(A)
    stored = np.zeros((n + 1, n + 1))
    stored[np.ix_(others, others)] = A[np.ix_(others, others)]
    stored[np.ix_(others, [i, n])] = -loop.B[0][others]
    stored[np.ix_([i, n], others)] = np.outer(K_i[0], A[i, others])
    return stored, (*loop.states, "v")


def seen_in_aileron(A, states):
    values, vectors = np.linalg.eig(A)
    vectors = vectors / vectors[states.index("da")]
    return values, vectors, np.linalg.inv(vectors)


@pytest.mark.parametrize(
    ("which", "name", "placement", "side"),
    [("floating", "nf", "before_gain", 1), ("floating", "nf", "after_gain", 1), ("leaning", "pf", "before_gain", 0),
     ("leaning", "pf", "after_gain", 0), ("floating", "rate", "after_gain", 1), ("leaning", "lqr", "before_gain", 1),
     ("leaning", "lqr", "after_gain", 1), ("floating", "filtered", "before_gain", 0)],
)  # fmt: skip
def test_growth_is_that_of_the_turning_eigenvectors(moving, which, name, placement, side):
    """``-w dv/dq`` by finite differences of eigenvectors, in coordinates in which the loop is written down directly."""
    study, envelope, designed, schedule, found = coupling(moving, which, name)

    def at(q):
        A, states = frozen_loop(study, envelope, designed, schedule, q, placement, side)
        if len(A) > len(found.states):  # the rest of what is stored across K_i: an eigenvalue zero that v keeps out
            values, vectors = np.linalg.eig(A)
            keep = np.argsort(np.abs(values))[1:]
            vectors = vectors[:, keep] / vectors[states.index("da"), keep]
            left = np.linalg.eig(A.T)
            rows = np.array([left.eigenvectors[:, np.argmin(np.abs(left.eigenvalues - v))] for v in values[keep]])
            return values[keep], vectors, rows / np.sum(rows * vectors.T, axis=-1)[:, None]
        return seen_in_aileron(A, states)

    values, _, left = at(Q)
    step = 0.2
    (low, below, _), (high, above, _) = at(Q - step), at(Q + step)
    said = found.placed[placement].rate_shift[0, 1, side]
    for i, value in enumerate(values):
        j, k = np.argmin(np.abs(low - value)), np.argmin(np.abs(high - value))
        turning = (above[:, k] - below[:, j]) / (2.0 * step)
        mine = said[np.argmin(np.abs(found.eigenvalues[0, 1] - value))]
        assert mine == pytest.approx(-left[i] @ turning, rel=1e-4, abs=1e-9), value


@pytest.mark.parametrize("placement", ["before_gain", "after_gain"])
def test_a_mode_grows_as_said_while_q_moves(moving, placement):
    """A mode followed through ``x' = A(q(t)) x``: its growth beyond the integral of the eigenvalue."""
    study, envelope, designed, schedule, found = coupling(moving, "leaning", "pf")
    rate, duration = 20.0, 0.25
    nodes = Q + rate * duration * np.linspace(-0.05, 1.05, 9)
    frozen = [frozen_loop(study, envelope, designed, schedule, q, placement, 1) for q in nodes]
    states = frozen[0][1]
    A = BarycentricInterpolator(nodes, np.array([matrix for matrix, _ in frozen]))
    start = found.eigenvalues[0, 1]
    slow = start[np.argmax(start.real + 1e-6 * start.imag)]

    def mode(q):
        values, vectors, left = seen_in_aileron(A(q), states)
        i = np.argmin(np.abs(values - slow))
        return values[i], vectors[:, i], left[i]

    qs = np.linspace(Q, Q + rate * duration, 201)
    along = np.array([mode(q)[0] for q in qs])
    area = duration * (along.sum() - 0.5 * (along[0] + along[-1])) / 200
    done = solve_ivp(
        lambda t, x: A(Q + rate * t) @ x, (0.0, duration), mode(Q)[1].astype(complex), rtol=1e-10, atol=1e-13
    )
    grown = np.log(mode(qs[-1])[2] @ done.y[:, -1]) - area
    grown = complex(grown.real, (grown.imag + np.pi) % (2.0 * np.pi) - np.pi)
    sigma = found.placed[placement].rate_shift[0, 1, 1][np.argmin(np.abs(start - slow))]
    assert grown == pytest.approx(sigma * rate * duration, rel=0.05)


def test_without_a_rest_elsewhere_only_the_moving_trim_acts(moving):
    """At a reference of zero nothing is stored: both placements and both sides are one."""
    study, envelope, designed, schedule, _ = coupling(moving, "floating", "nf")
    found = hidden_coupling(replace(study, reference=Reference(0.0, 1.0)), envelope.plant, designed, schedule)
    assert np.array_equal(found.before_gain.peak, found.after_gain.peak)
    np.testing.assert_allclose(found.before_gain.B[..., 0, :], found.before_gain.B[..., 1, :])
    assert np.max(np.abs(found.trim_slope)) > 0.0


def test_equilibrium_moves_as_it_does(moving):
    """``-A^-1 B`` of the totals is how what rests moves with q."""
    study, _, _, schedule, found = coupling(moving, "leaning", "pf")
    k = by_slope(schedule, 1)
    system = moving["leaning"][1].plant.system

    def rest(q):
        condition = flight_condition(H, "dynamic_pressure", q)
        model = linearise(system, condition, trim(system, condition, study.trim))
        servo, r = servo_tab(model), study.reference.aileron
        dt = float(-servo.F[1, 0] * r / servo.G[1, 0])
        return np.array([model.state_offset[0] + dt, model.state_offset[2] + r, (-dt - k(q)["K_f"] * r) / k(q)["K_i"]])

    moved = (rest(Q + 0.1) - rest(Q - 0.1)) / 0.2
    said = -np.linalg.solve(found.before_gain.A[0, 1, 1], found.before_gain.B[0, 1, 1])
    at = [found.states.index(name) for name in ("dt", "da", "int_a")]
    np.testing.assert_allclose(said[at], moved, rtol=1e-5, atol=1e-12)


def test_edges_follow_the_rule_outside(moving):
    _, _, _, _, clip = coupling(moving, "floating", "nf")
    _, _, _, _, refuse = coupling(moving, "floating", "nf", rules=ScheduleRules(out_of_range="refuse"))
    assert np.all(np.isnan(refuse.before_gain.peak[0, [0, -1], [0, 1]]))
    assert np.all(np.isfinite(clip.before_gain.peak))
    np.testing.assert_array_equal(refuse.before_gain.peak[0, 1], clip.before_gain.peak[0, 1])
    # Clipped gains rest: what is left is the plant's part, whatever the side inside says.
    assert clip.before_gain.settled[0, 0, 0] != pytest.approx(clip.before_gain.settled[0, 0, 1], rel=0.1)


def test_a_monotone_cubic_has_one_slope(moving):
    _, _, _, _, found = coupling(moving, "floating", "nf", rules=ScheduleRules("monotone_cubic"))
    np.testing.assert_allclose(found.before_gain.peak[0, 1, 0], found.before_gain.peak[0, 1, 1], rtol=1e-9)
    assert not np.allclose(found.before_gain.peak[0, 0, 0], found.before_gain.peak[0, 0, 1], rtol=1e-3)


def test_a_failed_point_breaks_only_the_sides_that_see_it(moving):
    study, envelope, designed, schedule, whole = coupling(moving, "leaning", "pf", 0.02)
    failed = np.array([[False, False, True]])
    outcomes = designed.outcomes.failing(failed, Outcome.INFEASIBLE, lambda index: "no gains")
    gains = tuple(replace(g, values=np.where(failed, np.nan, g.values)) for g in designed.gains)
    spoilt = replace(designed, outcomes=outcomes, gains=gains)
    found = hidden_coupling(study, envelope.plant, spoilt, replace(schedule, gains=gains, outcomes=outcomes), 0.02)
    for name in ("before_gain", "after_gain"):
        mine, theirs = found.placed[name], whole.placed[name]
        for field in ("A", "B", "rate_shift", "settled", "peak"):
            a, b = getattr(mine, field), getattr(theirs, field)
            np.testing.assert_array_equal(a[0, 0], b[0, 0])
            np.testing.assert_array_equal(a[0, 1, 0], b[0, 1, 0])
            assert np.all(np.isnan(a[0, 2]))
        assert np.all(np.isnan(mine.peak[0, 1, 1]))
        assert np.isnan(mine.settled[0, 1, 1])


def test_batch_is_the_single_points(wind_tunnel_study, wind_tunnel_envelope):
    for name in ("nf", "lqr"):
        designed = wind_tunnel_envelope.controller(name)
        schedule = schedule_of(wind_tunnel_envelope, designed, NOWHERE)
        whole = hidden_coupling(wind_tunnel_study, wind_tunnel_envelope.plant, designed, schedule, 0.05)
        for index in ((0, 0), (1, 2)):
            only = np.zeros((2, 4), dtype=bool)
            only[index] = True
            alone = replace(
                designed, outcomes=designed.outcomes.failing(~only, Outcome.INFEASIBLE, lambda _: "left out")
            )
            one = hidden_coupling(wind_tunnel_study, wind_tunnel_envelope.plant, alone, schedule, 0.05)
            for field in ("settled", "peak", "rate_shift", "A", "B"):
                a, b = getattr(one.before_gain, field)[index], getattr(whole.before_gain, field)[index]
                np.testing.assert_allclose(a, b, rtol=1e-12, atol=1e-14 * np.max(np.abs(b)))


def test_ramp_deviation_against_the_exponential():
    rng = np.random.default_rng(3)
    for lag in (0.0, 0.07, 0.5):
        n = 5
        A = rng.standard_normal((n, n)) * 6.0
        A -= (np.max(np.linalg.eigvals(A).real) + 1.0) * np.eye(n)
        forcing, late = rng.standard_normal((2, 3, n))
        last, largest = ramp_deviation(A[None], forcing[None], late[None], lag, 2)
        times = np.linspace(0.0, 12.0, 40001)
        for case in range(3):
            whole = np.zeros((n + 2, n + 2))  # [y, 1, e^(-t/lag)]
            whole[:n, :n], whole[:n, n] = A, forcing[case] + late[case]
            begin = np.zeros(n + 2)
            begin[n] = 1.0
            if lag:
                whole[:n, n + 1], whole[n + 1, n + 1], begin[n + 1] = -late[case], -1.0 / lag, 1.0
            step, x, seen = expm(whole * times[1]), begin, []
            for _ in times:
                seen.append(x[2])
                x = step @ x
            assert last[0, case] == pytest.approx(seen[-1], rel=1e-4, abs=1e-6)
            assert largest[0, case] == pytest.approx(np.max(np.abs(seen)), rel=1e-5)


def test_ramp_deviation_where_lag_and_mode_coincide():
    last, largest = ramp_deviation(np.array([[[-4.0]]]), np.zeros((1, 1, 1)), np.ones((1, 1, 1)), 0.25, 0)
    assert (last[0, 0], largest[0, 0]) == (0.25, 0.25)
    last, largest = ramp_deviation(np.array([[[4.0]]]), np.ones((1, 1, 1)), np.ones((1, 1, 1)), 0.0, 0)
    assert np.isnan(last[0, 0])
    assert np.isnan(largest[0, 0])


def test_refuses_what_it_cannot_move(wind_tunnel_study, wind_tunnel_envelope, moving):
    study, envelope, designed, schedule, _ = coupling(moving, "floating", "nf")
    for lag in (-1.0, np.inf, np.nan):
        with pytest.raises(ValueError, match="lag of the scheduling signal"):
            hidden_coupling(study, envelope.plant, designed, schedule, lag)
    by_point = replace(study, trim=TrimRequest(np.full((1, 3), 0.1)))
    assert "point by grid point" in why_no_coupling(by_point, envelope.plant, designed)
    ideal = replace(study, tab_actuator=Actuator())
    assert "ideal tab deflection" in why_no_coupling(ideal, envelope.plant, designed)
    with pytest.raises(ValueError, match="ideal tab deflection"):
        hidden_coupling(ideal, envelope.plant, designed, schedule)
    late = replace(designed, loop=replace(designed.loop, delay=(0.01,)))
    assert "transport delay" in why_no_coupling(study, envelope.plant, late)
