"""Schedules made of random numbers, and GNU Octave to read their files."""

import os
import shutil
import subprocess

import numpy as np
import pytest

from design.gains import Gain
from design.outcome import Outcome, Outcomes
from model.flight import GridAxis
from schedules.schedule import GainSchedule, Provenance

AXES = (GridAxis("altitude", "m", ()), GridAxis("dynamic_pressure", "Pa", ()), GridAxis("mach", "1", ()))
STATES = ("dt", "dt_rate", "da", "da_rate", "int_a")
CLASSICAL_UNITS = {"K_p": "1", "K_d": "s", "K_i": "1/s"}
LQR_UNITS = {f"K_{u}_{x}": "N m/rad" for u in ("T_t", "T_a") for x in STATES} | {
    f"N_{u}_r_a": "N m/rad" for u in ("T_t", "T_a")
}
PROVENANCE = Provenance(
    design_id="d-0123456789abcdef",
    design_name='wind, "tunnel" # Flügel\n\N{ROCKET}',
    request_digest="sha256:" + "0f" * 32,
    version="0.1.0",
    created_at="2026-01-02T03:04:05Z",
)


@pytest.fixture
def make_schedule():
    """Builder: shape of the grid, kind, points that failed -> a schedule of random gains."""

    def make(shape=(4, 6), kind="negative_feedback", failed=(), seed=0):
        rng = np.random.default_rng(seed)
        axes = tuple(
            GridAxis(a.name, a.unit, tuple((100.0 * np.cumsum(rng.uniform(0.5, 2.0, n))).tolist()))
            for a, n in zip(AXES, shape, strict=False)
        )
        outcomes = Outcomes.all_ok(shape)
        for point in failed:
            where = np.zeros(shape, dtype=bool)
            where[point] = True
            outcomes = outcomes.failing(
                where, Outcome.INFEASIBLE, lambda index: f'gain margin 4.1 dB, "short", at {index}'
            )
        units = LQR_UNITS if kind == "lqr" else CLASSICAL_UNITS
        gains = tuple(
            Gain(
                name,
                unit,
                np.where(outcomes.ok, rng.standard_normal(shape) * 10.0 ** rng.integers(-3, 4), np.nan),
            )
            for name, unit in units.items()
        )
        return GainSchedule("main", kind, axes, gains, outcomes, "T = -K x + N r", PROVENANCE)

    return make


@pytest.fixture
def same_schedule():
    """Assert that two schedules are the same, gains to the last bit."""

    def check(one, other):
        for name in ("controller", "kind", "axes", "law", "provenance"):
            assert getattr(one, name) == getattr(other, name)
        assert one.outcomes.codes.tolist() == other.outcomes.codes.tolist()
        assert one.outcomes.reasons.tolist() == other.outcomes.reasons.tolist()
        assert [(g.name, g.unit) for g in one.gains] == [(g.name, g.unit) for g in other.gains]
        for a, b in zip(one.gains, other.gains, strict=True):
            assert a.values.shape == b.values.shape
            assert a.values.tobytes() == b.values.tobytes()

    return check


@pytest.fixture
def octave(tmp_path):
    """Run an Octave script in `tmp_path`, whose files it may load; returns what it printed, as numbers."""
    program = shutil.which("octave-cli")
    if program is None:
        if os.environ.get("CI", "").lower() in ("1", "true"):
            pytest.fail("octave-cli is not installed: under CI this test must run")
        pytest.skip("octave-cli is not installed: the file was not read by Octave")

    def run(script):
        (tmp_path / "script.m").write_text(script)
        done = subprocess.run(
            [program, "--norc", "--quiet", "--no-window-system", "script.m"],
            cwd=tmp_path, capture_output=True, text=True, timeout=60, check=False,
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
        return np.array([float(word) for word in done.stdout.split()])

    return run
