"""Proofs of whole schedules: never contradicted, refuted where they are bad, else said in words."""

from dataclasses import replace

import numpy as np
import pytest

from design.lqr.synthesis import LqrController
from design.outcome import Outcome, Outcomes
from model.trim import HeldTorque, TrimRequest
from schedules.perturbations import Uncertainty, perturbed_model
from schedules.proof.cells import cells
from schedules.proof.decay import decay_rates, slowest
from schedules.proof.flown_with import closed_with
from schedules.proof.prove import ProofRequest, prove
from schedules.proof.result import CellStatus
from schedules.study import GridRequest

DERIVATIVES = ("C_Ha_da", "C_Ha_dt", "C_Ht_da", "C_Ht_dt")
FIFTH = tuple(Uncertainty(name, 0.2) for name in DERIVATIVES)


@pytest.fixture(scope="session")
def proved(example_a, example_b):
    """Proofs of all six designs of the examples, at half the slowest pole's rate."""
    return {
        (example, name): prove(study, envelope.plant, envelope.controller(name))
        for example, (study, envelope) in {"a": example_a, "b": example_b}.items()
        for name in ("nf", "pf", "lqr")
    }


def all_statuses(proof):
    return {cell.status for cell in proof.cells}


@pytest.mark.parametrize("name", ["nf", "pf", "lqr"])
@pytest.mark.parametrize("example", ["a", "b"])
def test_the_examples_are_proved_everywhere_at_half_the_slowest_poles_rate(proved, example, name):
    proof = proved[example, name]
    assert proof.proved
    assert len(proof.cells) == proof.summary.proved == 3
    assert all(cell.alpha >= cell.wanted > 0.0 for cell in proof.cells)
    assert proof.summary.alpha == min(cell.alpha for cell in proof.cells)
    assert "every cell is proved" in proof.summary.words


@pytest.mark.parametrize("example", ["example_a", "example_b"])
def test_lqr_is_proved_with_every_derivative_off_by_a_fifth_each_alone(request, example):
    study, envelope = request.getfixturevalue(example)
    proof = prove(study, envelope.plant, envelope.controller("lqr"), ProofRequest(changes=FIFTH))
    assert proof.proved
    assert proof.common is not None
    assert "each alone" in proof.covers


def test_lqr_is_proved_with_all_derivatives_off_by_two_fifths_together(example_a):
    study, envelope = example_a
    changes = tuple(Uncertainty(name, 0.4) for name in DERIVATIVES)
    proof = prove(study, envelope.plant, envelope.controller("lqr"), ProofRequest(changes=changes, together=True))
    assert proof.proved


def test_one_matrix_for_the_envelope_proves_every_cell(proved):
    proof = proved["a", "lqr"]
    assert proof.summary.common
    assert all(piece.P is proof.common for cell in proof.cells for piece in cell.pieces)
    assert "within the envelope" in proof.summary.words


@pytest.mark.parametrize("name", ["nf", "pf", "lqr"])
def test_a_hundred_thousand_random_points_never_contradict_a_proof(proved, example_a, loops_at, name):
    """At each, made the product's own way, the piece's Lyapunov function decays at least as fast as was proved."""
    study, envelope = example_a
    rng, count = np.random.default_rng(11), 0
    pieces = [piece for cell in proved["a", name].cells for piece in cell.pieces]
    each = -(-100_000 // len(pieces))
    for piece in pieces:
        h, s = (rng.uniform(*ends, each) for ends in (piece.box.altitude, piece.box.speed))
        loops = loops_at(study, envelope, envelope.controller(name), h, s)
        assert np.min(decay_rates(loops, piece.P)) >= piece.alpha
        count += each
    assert count >= 100_000


def test_random_plants_within_their_ranges_never_contradict_a_proof(example_a):
    study, envelope = example_a
    changes = (*FIFTH, Uncertainty("aileron_inertia", 0.3))
    designed, rng = envelope.controller("lqr"), np.random.default_rng(2)
    for together in (False, True):
        proof = prove(study, envelope.plant, designed, ProofRequest(changes=changes, together=together))
        assert proof.proved
        for cell in proof.cells:
            parts = rng.uniform(-1.0, 1.0, (2000, 5))
            if not together:  # mixtures of what is off alone
                parts = parts / np.sum(np.abs(parts), axis=1, keepdims=True) * rng.uniform(0.0, 1.0, (2000, 1))
                parts[:, 4] = 0.0
            factors = 1.0 + parts * np.array([c.change for c in changes])
            corner = np.ravel_multi_index(cell.index, (2, 4))
            model = perturbed_model(envelope.plant, np.full(2000, corner), [c.parameter for c in changes], factors)
            gains = {g.name: np.full(2000, g.values.reshape(-1)[corner]) for g in designed.gains}
            loops = closed_with(study, envelope.plant, designed, model, gains)
            assert np.min(decay_rates(loops, cell.pieces[0].P)) >= cell.alpha


def test_what_is_proved_is_never_more_than_the_slowest_frozen_pole(proved, example_a, loops_at):
    study, envelope = example_a
    for name in ("nf", "pf", "lqr"):
        for cell in proved["a", name].cells:
            h, s = (x.ravel() for x in np.meshgrid(*(np.linspace(*e, 25) for e in (cell.box.altitude, cell.box.speed))))
            rates = slowest(loops_at(study, envelope, envelope.controller(name), h, s))
            assert cell.alpha <= np.min(rates)
            assert cell.slowest.rate <= np.min(rates) * 1.01


def test_the_largest_rate_is_more_than_was_asked_and_less_than_the_slowest_pole(example_a):
    study, envelope = example_a
    proof = prove(study, envelope.plant, envelope.controller("lqr"), ProofRequest(largest=True))
    for cell in proof.cells:
        assert 0.9 * cell.slowest.rate < cell.alpha <= cell.slowest.rate


def test_pieces_cover_their_cell(proved):
    for proof in proved.values():
        for cell in proof.cells:
            (h1, h2), (s1, s2) = cell.box.altitude, cell.box.speed
            area = sum((p.box.altitude[1] - p.box.altitude[0]) * (p.box.speed[1] - p.box.speed[0]) for p in cell.pieces)
            assert area == pytest.approx((h2 - h1) * (s2 - s1), rel=1e-12)


# Bad schedules ---------------------------------------------------------------------------------------------------


def tables_of(designed):
    return {gain.name: gain.values.copy() for gain in designed.gains}


def mid_air(designed):
    """LQR gains, stable at every grid point, that are not between two of them."""
    rng = np.random.default_rng(1)
    K, A, B = designed.loop.K, designed.loop.A, designed.loop.B
    scale = np.max(np.abs(K[0, 1]), axis=0)
    while True:
        low, high = (K[0, 1] + 4.0 * rng.standard_normal(K[0, 1].shape) * scale for _ in range(2))
        changed = np.stack([np.stack([low, low, high, high])] * 2)
        middle = A[0, 1] - B[0, 1] @ (0.5 * (low + high))
        if np.all(slowest(A - B @ changed) > 0.5) and slowest(middle) < -5.0:
            names = [f"K_{u}_{x}" for u in ("T_t", "T_a") for x in designed.loop.states]
            return dict(zip(names, np.moveaxis(changed.reshape(2, 4, -1), -1, 0), strict=True))


def planted(kind, tables):
    """Tables with one fault of a kind that people make."""
    bad = {name: values.copy() for name, values in tables.items()}

    def at(name, factor, where=(1, 2)):
        bad[name][where] = bad[name][where] * factor

    if kind == "sign of one entry":
        at("K_T_a_da", -3.0)
    elif kind == "sign of the integral":
        at("K_T_a_int_a", -1.0)
    elif kind == "sign of a whole table":
        for name in bad:
            bad[name] = -bad[name]
    elif kind == "integral left out":
        for name in ("K_T_a_int_a", "K_T_t_int_a"):
            bad[name][0, 3] = 0.0
    elif kind == "inputs exchanged":
        for state in ("dt", "da", "dt_rate", "da_rate", "int_a"):
            bad[f"K_T_t_{state}"], bad[f"K_T_a_{state}"] = tables[f"K_T_a_{state}"], tables[f"K_T_t_{state}"]
    elif kind == "angle and rate exchanged":
        for u in ("T_t", "T_a"):
            bad[f"K_{u}_da"], bad[f"K_{u}_da_rate"] = -tables[f"K_{u}_da_rate"], -tables[f"K_{u}_da"]
    elif kind == "degrees for radians, wrong way":
        for name in bad:
            bad[name][0] = bad[name][0] / 57.3
    elif kind == "tables of one entry shifted":
        bad["K_T_a_int_a"] = bad["K_T_a_int_a"] * np.array([1.0, 1.0, 40.0, 1.0])
    elif kind == "all zero at one point":
        for name in bad:
            bad[name][1, 1] = 0.0
    elif kind == "damping of the tab reversed":
        bad["K_T_t_dt_rate"][:, 1] *= -1.0
    elif kind == "one point a hundred times too small":
        for name in bad:
            bad[name][1, 3] = bad[name][1, 3] / 100.0
    elif kind == "rate feedback of the aileron reversed at one altitude":
        bad["K_T_a_da_rate"][1] *= -1.0
    return bad


KINDS = (
    "sign of one entry", "sign of the integral", "sign of a whole table", "integral left out",
    "inputs exchanged", "angle and rate exchanged", "degrees for radians, wrong way", "tables of one entry shifted",
    "all zero at one point",
    "damping of the tab reversed", "one point a hundred times too small",
    "rate feedback of the aileron reversed at one altitude", "stable at the grid points only",
)  # fmt: skip


@pytest.mark.parametrize("kind", KINDS)
def test_a_bad_schedule_is_refuted_with_a_point_that_is_really_bad(example_a, with_gains, loops_at, kind):
    study, envelope = example_a
    good = envelope.controller("lqr")
    wanted = 10.0  # half the slowest pole's rate of the good one
    bad = with_gains(study, envelope, good, mid_air(good) if kind in KINDS[-1:] else planted(kind, tables_of(good)))
    request = ProofRequest(decay=0.0 if kind in KINDS[-1:] else wanted, most_pieces=8)
    proof = prove(study, envelope.plant, bad, request)
    h, s = (x.ravel() for x in np.meshgrid(np.linspace(0.0, 3000.0, 13), np.linspace(245.0, 1531.25, 85)))
    rates = slowest(loops_at(study, envelope, bad, h, s))
    for cell in proof.cells:
        (h1, h2), (s1, s2) = cell.box.altitude, cell.box.speed
        truth = np.min(rates[(h >= h1) & (h <= h2) & (s >= s1) & (s <= s2)])
        if truth <= request.decay:
            assert cell.status is CellStatus.REFUTED
            point = cell.slowest
            real = slowest(loops_at(study, envelope, bad, *(np.array([x]) for x in (point.altitude, point.speed))))[0]
            assert real <= request.decay
            assert point.rate == pytest.approx(real, rel=1e-6, abs=1e-6)
            assert h1 <= point.altitude <= h2
            assert s1 <= point.speed <= s2
            assert "decays slower" in cell.reason
        elif cell.status is CellStatus.PROVED:
            assert cell.alpha <= truth
    assert CellStatus.REFUTED in all_statuses(proof)
    assert not proof.proved


def test_a_schedule_stable_at_its_points_only_has_good_corners(example_a, with_gains):
    study, envelope = example_a
    bad = with_gains(study, envelope, envelope.controller("lqr"), mid_air(envelope.controller("lqr")))
    assert np.all(slowest(bad.loop.closed) > 0.0)


@pytest.mark.parametrize("factor", [-1.0, 0.0, 8.0])
@pytest.mark.parametrize("gain", ["K_p", "K_d", "K_i"])
def test_bad_classical_gains_are_never_proved(example_a, with_gains, loops_at, gain, factor):
    study, envelope = example_a
    tables = tables_of(envelope.controller("nf"))
    tables[gain][:, 2] *= factor
    bad = with_gains(study, envelope, envelope.controller("nf"), tables)
    proof = prove(study, envelope.plant, bad, ProofRequest(decay=5.0, most_pieces=8))
    h, s = (x.ravel() for x in np.meshgrid(np.linspace(0.0, 3000.0, 5), np.linspace(245.0, 1531.25, 85)))
    rates = slowest(loops_at(study, envelope, bad, h, s))
    for cell in proof.cells:
        inside = (s >= cell.box.speed[0]) & (s <= cell.box.speed[1])
        if np.min(rates[inside]) <= 5.0:
            assert cell.status is CellStatus.REFUTED
        else:
            assert cell.status is not CellStatus.REFUTED


@pytest.mark.parametrize("seed", range(30))
def test_verdicts_on_random_schedules_are_never_wrong(example_a, with_gains, loops_at, seed):
    """Gains of every table and point off at random, a little or a lot: dense samples are the judge."""
    study, envelope = example_a
    rng = np.random.default_rng(seed)
    good = envelope.controller(("nf", "pf", "lqr")[seed % 3])
    spread = (0.1, 0.5, 1.5)[(seed // 3) % 3]
    tables = {name: t * np.exp(spread * rng.standard_normal(t.shape)) for name, t in tables_of(good).items()}
    bad = with_gains(study, envelope, good, tables)
    proof = prove(study, envelope.plant, bad, ProofRequest(decay=1.0, most_pieces=4))
    for cell in proof.cells:
        h, s = (x.ravel() for x in np.meshgrid(*(np.linspace(*e, 21) for e in (cell.box.altitude, cell.box.speed))))
        rates = slowest(loops_at(study, envelope, bad, h, s))
        if cell.status is CellStatus.PROVED:
            assert 1.0 < cell.alpha <= np.min(rates)
        if cell.status is CellStatus.REFUTED:
            point = np.array([cell.slowest.altitude]), np.array([cell.slowest.speed])
            assert slowest(loops_at(study, envelope, bad, *point))[0] <= 1.0 + 1e-9
        if np.min(rates) <= 0.9:
            assert cell.status is CellStatus.REFUTED
        assert cell.status is not CellStatus.SAMPLED


def test_more_than_was_wanted_is_not_said_of_the_common_matrix(example_a):
    study, envelope = example_a
    proof = prove(study, envelope.plant, envelope.controller("lqr"), ProofRequest(largest=True))
    assert proof.common is not None
    assert "within a cell" in proof.summary.words


# Finer grids -----------------------------------------------------------------------------------------------------


def test_a_finer_grid_with_the_same_gains_loses_no_proof(example_a, envelope_of, with_gains):
    """Gains in the new points are what the old schedule has there: the schedule is the same, and so is the proof."""
    study, envelope = example_a
    speeds = np.array(study.grid.speed)
    finer = np.sort(np.concatenate([speeds, 0.5 * (speeds[1:] + speeds[:-1])]))
    grid = GridRequest((0.0, 1500.0, 3000.0), "dynamic_pressure", tuple(finer.tolist()))
    fine_study, fine = envelope_of(grid=grid)
    for name in ("nf", "lqr"):
        designed = envelope.controller(name)
        coarse = prove(study, envelope.plant, designed, ProofRequest(decay=2.0))
        assert coarse.proved
        tables = {
            g.name: np.stack(
                [np.interp(finer, speeds, row) for row in (g.values[0], g.values.mean(axis=0), g.values[1])]
            )
            for g in designed.gains
        }
        same = with_gains(fine_study, fine, fine.controller(name), tables)
        proof = prove(fine_study, fine.plant, same, ProofRequest(decay=2.0))
        assert proof.proved
        assert len(proof.cells) == 12


# What is not proved ----------------------------------------------------------------------------------------------


def test_a_failed_point_leaves_its_cells_undecided_and_the_others_proved(example_a, with_gains):
    study, envelope = example_a
    good = envelope.controller("lqr")
    failed = np.zeros((2, 4), dtype=bool)
    failed[1, 0] = True
    outcomes = Outcomes.all_ok((2, 4)).failing(failed, Outcome.INFEASIBLE, lambda index: "no gains do it")
    gains = tuple(replace(gain, values=np.where(failed, np.nan, gain.values)) for gain in good.gains)
    loop = good.loop.take(~failed).spread(~failed)
    proof = prove(study, envelope.plant, replace(good, outcomes=outcomes, gains=gains, loop=loop))
    assert [cell.status for cell in proof.cells] == ["undecided", "proved", "proved"]
    assert "[1, 0] is infeasible: no gains do it" in proof.cells[0].reason
    assert proof.common is None
    assert not proof.proved
    assert np.isnan(proof.summary.alpha)


@pytest.mark.parametrize("shape", [((0.0,), (245.0, 980.0)), ((0.0, 3000.0), (980.0,)), ((500.0,), (600.0,))])
def test_an_axis_of_one_breakpoint(envelope_of, only_lqr, shape):
    study, envelope = envelope_of(grid=GridRequest(shape[0], "dynamic_pressure", shape[1]), controllers=only_lqr)
    proof = prove(study, envelope.plant, envelope.controllers[0])
    assert proof.proved
    assert len(proof.cells) == 1
    if len(shape[0]) == len(shape[1]) == 1:
        rate = slowest(envelope.controllers[0].loop.closed)[0, 0]
        assert 0.5 * rate <= proof.cells[0].alpha <= rate * (1.0 + 1e-9)


@pytest.mark.parametrize("speed", [("airspeed", (20.0, 30.0, 45.0)), ("mach", (0.06, 0.09, 0.14))])
def test_grids_in_airspeed_and_mach_number_are_proved_too(envelope_of, only_lqr, loops_at, speed):
    study, envelope = envelope_of(grid=GridRequest((0.0, 3000.0), *speed), controllers=only_lqr)
    proof = prove(study, envelope.plant, envelope.controllers[0])
    assert proof.proved
    rng = np.random.default_rng(0)
    for cell in proof.cells:
        h, s = (rng.uniform(*ends, 5000) for ends in (cell.box.altitude, cell.box.speed))
        loops = loops_at(study, envelope, envelope.controllers[0], h, s)
        assert np.min(decay_rates(loops, cell.pieces[0].P)) >= cell.alpha


def test_unsteady_lags_and_compressibility_are_proved_too(envelope_of, only_lqr, wind_tunnel_study, loops_at):
    aerodynamics = replace(wind_tunnel_study.aerodynamics, damping="unsteady", compressibility="prandtl_glauert")
    study, envelope = envelope_of(controllers=only_lqr, aerodynamics=aerodynamics)
    proof = prove(study, envelope.plant, envelope.controllers[0])
    assert proof.proved
    rng = np.random.default_rng(0)
    for cell in proof.cells:
        for piece in cell.pieces:
            h, s = (rng.uniform(*ends, 3000) for ends in (piece.box.altitude, piece.box.speed))
            loops = loops_at(study, envelope, envelope.controllers[0], h, s)
            assert np.min(decay_rates(loops, piece.P)) >= piece.alpha


def test_the_airliner_is_proved(airliner):
    study, envelope = airliner
    proof = prove(study, envelope.plant, envelope.controllers[0])
    assert proof.proved


def test_loops_that_cannot_be_taken_apart_are_sampled_and_refuted_where_a_sample_is_bad(
    envelope_of, only_lqr, wind_tunnel_study, with_gains
):
    virtual = replace(wind_tunnel_study.aerodynamics, virtual_inertia=True)
    study, envelope = envelope_of(controllers=only_lqr, aerodynamics=virtual)
    proof = prove(study, envelope.plant, envelope.controllers[0])
    assert all_statuses(proof) == {CellStatus.SAMPLED}
    assert all("mass matrix" in cell.reason for cell in proof.cells)
    assert all(cell.slowest.rate > cell.wanted for cell in proof.cells)
    assert proof.family is None
    tables = tables_of(envelope.controllers[0])
    tables["K_T_a_da_rate"][1, 3] *= -2.0
    bad = with_gains(study, envelope, envelope.controllers[0], tables)
    worse = prove(study, envelope.plant, bad, ProofRequest(decay=1.0))
    assert [cell.status for cell in worse.cells] == ["sampled", "sampled", "refuted"]


def test_delays_are_sampled_without_a_point(envelope_of, only_lqr, wind_tunnel_study):
    late = replace(wind_tunnel_study.aileron_actuator, delay=1e-3)
    study, envelope = envelope_of(controllers=only_lqr, aileron_actuator=late)
    proof = prove(study, envelope.plant, envelope.controllers[0])
    assert all_statuses(proof) == {CellStatus.SAMPLED}
    assert all("aileron 0.001 s" in cell.reason and cell.slowest is None for cell in proof.cells)


def test_a_moving_trim_is_sampled(envelope_of, only_lqr):
    trim = TrimRequest(alpha=0.05, aileron=0.0, tab=HeldTorque("aileron", 1.0))
    study, envelope = envelope_of(controllers=only_lqr, trim=trim)
    proof = prove(study, envelope.plant, envelope.controllers[0])
    assert all_statuses(proof) == {CellStatus.SAMPLED}
    assert "not affine" in proof.reason


@pytest.mark.parametrize(
    "wrong", [{"fraction": 1.0}, {"fraction": -0.1}, {"decay": -1.0}, {"decay": np.inf}, {"most_pieces": 0}]
)
def test_a_request_out_of_range_is_refused(wrong):
    with pytest.raises(ValueError, match=next(iter(wrong))):
        ProofRequest(**wrong)


def test_a_parameter_named_twice_is_refused(example_a):
    study, envelope = example_a
    with pytest.raises(ValueError, match="twice"):
        prove(study, envelope.plant, envelope.controller("lqr"), ProofRequest(changes=FIFTH[:1] * 2))


def test_asking_for_more_than_the_slowest_pole_is_refuted(example_a):
    study, envelope = example_a
    assert isinstance(envelope.controller("lqr").request, LqrController)
    proof = prove(study, envelope.plant, envelope.controller("lqr"), ProofRequest(decay=25.0))
    assert all_statuses(proof) == {CellStatus.REFUTED}
    for cell, corner in zip(proof.cells, cells(envelope.plant.grid.axes), strict=True):
        assert cell.index == corner.index
