"""The comparisons, each of equal work, and the ratio we mean to reach on each."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import control as ct
import numpy as np
import orjson

from design.classical.controller import ClassicalController
from design.classical.steering import StepReference
from design.classical.synthesis import design_classical
from design.classical.tab_loop import tab_loop
from design.frequency.crossovers import critical_ratio, gain_crossings, phase_crossings
from design.frequency.feedback import closed_loop, open_loop_value
from design.frequency.loci import root_locus
from design.frequency.margins import margins
from design.lqr.riccati import solve_riccati
from design.lqr.synthesis import design_lqr
from design.response.step_response import step_response
from design.robustness.return_difference import smallest_return_difference
from model.examples import wind_tunnel
from model.flight import flight_condition
from model.linearise import linearise
from model.trim import TrimRequest, trim
from schedules.run import run
from tests.benchmarks import peers
from tests.benchmarks.cases import DURATION, GAINS, SAMPLES, STEP, TAB_ACTUATOR, Case, case, tab_only
from tests.benchmarks.manoeuvre_rows import manoeuvre_rows
from tests.benchmarks.measure import Row
from tests.benchmarks.proof_rows import proof_row, search_row
from tests.benchmarks.simulation_rows import simulation_rows


def rows() -> list[Row]:
    """All rows, in the order they are printed."""
    c = case()
    return [
        _linear_models(),
        _linearise_lqr(c),
        _lqr_scipy(c),
        _lqr_scipy_many(c),
        _lqr_control(c),
        _return_difference(c),
        _loci(c),
        _margins(c, 1),
        _margins(c, 80),
        *(_synthesis(c, controller) for controller in tab_only()),
        _all_margins(c),
        _steps(c),
        _refined_steps(c),
        *manoeuvre_rows(c),
        *simulation_rows(c),
        search_row(c),
        proof_row(c),
        _whole(c),
    ]


def _close(rtol: float) -> Any:
    def agree(ours: Any, theirs: Any) -> None:
        np.testing.assert_allclose(ours, theirs, rtol=rtol, atol=rtol * np.max(np.abs(theirs)))

    return agree


def _linear_models() -> Row:
    system, count = wind_tunnel(), 1000
    condition = flight_condition(
        np.linspace(0.0, 9000.0, count), "dynamic_pressure", np.geomspace(200.0, 2000.0, count)
    )
    neutral = trim(system, condition, TrimRequest(alpha=0.0))
    return Row(
        "linear models of 1000 points", "numpy loop", 20.0, lambda: linearise(system, condition, neutral).A,
        lambda: peers.numpy_linear_models(system, condition), _close(1e-12),
    )  # fmt: skip


def _linearise_lqr(c: Case) -> Row:
    controller = c.study.controllers[0]

    def ours() -> Any:
        model = linearise(c.plant.system, c.plant.grid.condition, c.plant.trim)
        return design_lqr(model, controller).K.reshape(25, 2, 5)

    return Row(
        "linearise + LQR with certificate", "ct.linearize + ct.lqr", 12.0, ours,
        lambda: peers.control_linearise_lqr(c.plant, c.weights), _close(1e-4),
    )  # fmt: skip


def _solve(c: Case) -> Any:
    return solve_riccati(c.tracking.A, c.tracking.B, c.weights.Q, c.weights.R).K


def _lqr_scipy(c: Case) -> Row:
    return Row(
        "LQR, 5 states", "scipy loop", 12.0, lambda: _solve(c), lambda: peers.scipy_lqr(c.tracking, c.weights),
        _close(1e-8),
    )  # fmt: skip


def _lqr_scipy_many(c: Case) -> Row:
    """A thousand points: the 25 of the case forty times; the peer's time is taken of one of them and multiplied."""
    copies = 40
    A, B = (np.tile(matrix, (copies, 1, 1)) for matrix in (c.tracking.A, c.tracking.B))

    def agree(ours: Any, theirs: Any) -> None:
        _close(1e-8)(ours[: len(theirs)], theirs)

    return Row(
        "LQR, 5 states, 1000 points", "scipy loop", 20.0, lambda: solve_riccati(A, B, c.weights.Q, c.weights.R).K,
        lambda: peers.scipy_lqr(c.tracking, c.weights), agree, copies,
    )  # fmt: skip


def _return_difference(c: Case) -> Row:
    """Smallest singular value of the return difference of both inputs, over 400 frequencies."""
    return Row(
        "sigma_min(I + L), 400 frequencies", "control + numpy svd", 80.0,
        lambda: smallest_return_difference(c.loop.A, c.loop.B, c.loop.K, peers.FREQUENCIES),
        lambda: peers.control_return_difference(c.loop), _close(1e-8),
    )  # fmt: skip


def _lqr_control(c: Case) -> Row:
    return Row(
        "LQR, 5 states", "ct.lqr loop (scipy method)", 12.0, lambda: _solve(c),
        lambda: peers.control_lqr(c.tracking, c.weights), _close(1e-8),
    )  # fmt: skip


def _loci(c: Case) -> Row:
    cut = c.loop.cut("tab")
    gains = root_locus(cut, count=GAINS).gains

    def agree(ours: Any, theirs: Any) -> None:
        for branches, loci in zip(ours, theirs, strict=True):
            for a, b in zip(branches.T[::20], loci[::20], strict=True):
                np.testing.assert_allclose(np.sort_complex(a), np.sort_complex(b), rtol=1e-6, atol=1e-6)

    return Row(
        f"root loci with tracking, {gains.shape[-1]} gains", "ct.root_locus_map loop", 40.0,
        lambda: root_locus(cut, gains).branches, lambda: peers.control_loci(c.loop, gains), agree,
    )  # fmt: skip


def _margins(c: Case, copies: int) -> Row:
    """The part of `margins` that does what `ct.margin` does: crossovers of both kinds, gain and phase there.

    With several copies of the 25 points, the peer's time is taken of one of them and multiplied.
    """
    cuts = c.loop.cuts()
    arrays = {name: np.repeat(getattr(cuts, name), copies, axis=1) for name in ("A", "b", "c", "gain")}
    several = replace(cuts, **arrays)

    def ours() -> Any:
        closed = closed_loop(several)
        gain, unity = critical_ratio(phase_crossings(closed).value), gain_crossings(closed)
        phase = np.abs(np.angle(-open_loop_value(unity.value)))
        return gain, np.rad2deg(np.nanmin(phase, axis=-1)).reshape(len(c.loop.inputs), -1)

    def agree(ours: Any, theirs: Any) -> None:
        np.testing.assert_allclose(ours[1][:, ::copies], theirs, rtol=1e-6)

    return Row(
        f"gain and phase margins, {25 * copies} points, 2 cuts", "ct.margin loop", 20.0 if copies == 1 else 60.0, ours,
        lambda: peers.control_margins(c.loop), agree, copies,
    )  # fmt: skip


def _synthesis(c: Case, controller: ClassicalController) -> Row:
    """Gains of 25 points by specs, against one root locus of one point: what the search must not take longer than."""
    servo = c.plant.servo_tab
    reference = StepReference(STEP, DURATION, c.plant.trim.state[..., 0])
    one = tab_loop(
        c.plant.model.take((0, 0)), servo.take((0, 0)), TAB_ACTUATOR, controller,
        {name: np.array(1.0) for name in controller.gain_units},
    ).stage("K_i")  # fmt: skip
    system = ct.ss(one.A, one.b[:, None], one.c[None, :], 0)
    gains = np.concatenate([[0.0], np.geomspace(0.1, 1000.0, GAINS - 1)])

    def ours() -> Any:
        return design_classical(servo, TAB_ACTUATOR, controller, reference, c.plant.outcomes).outcomes.ok

    def agree(ours: Any, theirs: Any) -> None:
        assert ours.all()
        assert theirs.shape == (GAINS, len(one.A))

    return Row(
        f"gains of 25 points by specs, {controller.name}", "one ct.root_locus_map", 1.0, ours,
        lambda: ct.root_locus_map(system, gains=gains).loci, agree,
    )  # fmt: skip


def _all_margins(c: Case) -> Row:
    def ours() -> Any:
        found = margins(c.loop.cuts())
        return np.stack([np.rad2deg(found.phase_margin), 1.0 / found.sensitivity_peak, found.disk_margin], axis=-1)

    return Row(
        "all margins, disk margin and peak of S", "ct.stability_ + disk_margins", 20.0, ours,
        lambda: peers.control_all_margins(c.loop), _close(2e-3),
    )  # fmt: skip


def _steps(c: Case) -> Row:
    def ours() -> Any:
        return np.max(np.abs(step_response(c.loop, np.array([STEP]), DURATION, SAMPLES).outputs), axis=-2)

    return Row(
        "step, 501 samples, 6 outputs, sampled peaks", "ct.forced_response loop", 60.0, ours,
        lambda: peers.control_steps(c.loop), _close(1e-9),
    )  # fmt: skip


def _refined_steps(c: Case) -> Row:
    def agree(ours: Any, theirs: Any) -> None:
        assert np.all(ours >= theirs * (1 - 1e-12))
        np.testing.assert_allclose(ours, theirs, rtol=2e-2)  # the peer's samples miss up to that much of a peak

    return Row(
        "step, peaks refined between the samples", "the same, sampled peaks", 30.0,
        lambda: step_response(c.loop, np.array([STEP]), DURATION, SAMPLES).peaks,
        lambda: peers.control_steps(c.loop), agree,
    )  # fmt: skip


def _whole(c: Case) -> Row:
    def ours() -> bytes:
        envelope = run(c.study)
        lqr = envelope.controllers[0]
        locus = root_locus(lqr.loop.cut("tab"), count=GAINS)
        response = step_response(lqr.loop, np.array([STEP]), DURATION, SAMPLES)
        assert lqr.assessment is not None
        answer = {
            "gains": {g.name: np.ascontiguousarray(g.values) for g in lqr.gains},
            "poles": [np.ascontiguousarray(lqr.assessment.poles.real), np.ascontiguousarray(lqr.assessment.poles.imag)],
            "locus_gains": locus.gains,
            "branches": [np.ascontiguousarray(locus.branches.real), np.ascontiguousarray(locus.branches.imag)],
            "margins": [[m.gain_margin_up_db, m.gain_margin_down_db, m.phase_margin] for m in lqr.assessment.margins],
            "time": np.ascontiguousarray(response.time), "outputs": np.ascontiguousarray(response.outputs),
            "peaks": [[d.peak_torque, d.peak_rate, d.peak_power] for d in lqr.assessment.demand],
        }  # fmt: skip
        return orjson.dumps(answer, option=orjson.OPT_SERIALIZE_NUMPY)

    def agree(ours: bytes, theirs: bytes) -> None:
        mine, other = orjson.loads(ours), json.loads(theirs)
        K = np.array([point["K"] for point in other])
        for i, u in enumerate(("T_t", "T_a")):
            for j, x in enumerate(("dt", "dt_rate", "da", "da_rate", "int_a")):
                np.testing.assert_allclose(np.ravel(mine["gains"][f"K_{u}_{x}"]), K[:, i, j], rtol=1e-6, atol=1e-9)
        da = np.array([point["outputs"][0] for point in other])
        np.testing.assert_allclose(np.reshape(mine["outputs"], (25, SAMPLES, -1))[..., 0], da, rtol=1e-6, atol=1e-9)

    return Row(
        "whole request: run + locus + step + JSON", "python-control loop", 40.0, ours,
        lambda: peers.control_whole(c.plant, c.weights), agree,
    )  # fmt: skip
