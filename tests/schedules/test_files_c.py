"""The C99 header and source: compiled by gcc with every warning an error, and run."""

import re
import subprocess
from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import RegularGridInterpolator

from model.flight import GridAxis
from schedules.files import write_schedule
from schedules.fill import filled
from schedules.interpolate import interpolate
from tests.schedules.compiled_schedules import Program, compiler
from tests.schedules.hostile_schedules import NAMES, hostile, points_around

CLIPPED, FILLED, HELD, REFUSED, NOT_A_NUMBER = 1, 2, 4, -1, -2


def in_precision(schedule, points, dtype):
    """The corner sum with every operation rounded to `dtype`, in the order of `schedules.interpolate`."""
    axes = [np.array(axis.values).astype(dtype) for axis in schedule.axes]
    tables = [gain.values.astype(dtype) for gain in schedule.gains]
    answers = []
    for point in points:
        sides = []
        for axis, x in zip(axes, point.astype(dtype), strict=True):
            x = min(max(x, axis[0]), axis[-1])
            low = min(int(np.sum(axis <= x)) - 1, max(len(axis) - 2, 0))
            t = (x - axis[low]) / (axis[low + 1] - axis[low]) if len(axis) > 1 else dtype(0)
            sides.append(((low, dtype(1) - t), (low + 1, t)))
        sums = [dtype(0)] * len(tables)
        for corner in np.ndindex((2,) * len(axes)):
            weight, index = dtype(1), []
            for side, which in zip(sides, corner, strict=True):
                weight = dtype(weight * side[which][1])
                index.append(side[which][0])
            if weight > 0:
                sums = [dtype(s + dtype(weight * t[tuple(index)])) for s, t in zip(sums, tables, strict=True)]
        answers.append([float(s) for s in sums])
    return np.array(answers)


SHAPES = [(4, 6), (5,), (1, 6), (4, 1), (1, 1), (2, 3, 4), (3, 1, 2)]


@pytest.mark.parametrize("shape", SHAPES)
def test_double_is_the_schedules_own_interpolation(make_schedule, tmp_path, shape):
    schedule = make_schedule(shape)
    points = points_around(schedule)
    status, gains = Program(tmp_path, schedule).driver()(points)
    expected = interpolate(schedule, tuple(points.T))
    np.testing.assert_array_equal(status, expected.clipped.astype(int))
    for column, gain in zip(gains.T, expected.gains, strict=True):
        np.testing.assert_allclose(column, gain.values, rtol=1e-15, atol=0)


@pytest.mark.parametrize("shape", [(4, 6), (2, 3, 4)])
def test_double_is_scipys(make_schedule, tmp_path, shape):
    schedule = make_schedule(shape)
    points = points_around(schedule)
    _, gains = Program(tmp_path, schedule).driver()(points)
    axes = [np.array(axis.values) for axis in schedule.axes]
    inside = np.clip(points, [x[0] for x in axes], [x[-1] for x in axes])
    for column, gain in zip(gains.T, schedule.gains, strict=True):
        scale = np.max(np.abs(gain.values))
        np.testing.assert_allclose(column, RegularGridInterpolator(axes, gain.values)(inside), atol=1e-13 * scale)


@pytest.mark.parametrize("shape", SHAPES)
def test_float_is_the_table_in_single_precision(make_schedule, tmp_path, shape):
    """Every operation rounded once: to one unit in the last place, and near what double precision answers."""
    schedule = make_schedule(shape)
    points = points_around(schedule)
    _, gains = Program(tmp_path, schedule).driver("-DGAINFIELD_FLOAT")(points)
    expected = in_precision(schedule, points, np.float32)
    assert np.all(np.abs(gains - expected) <= np.spacing(np.abs(expected).astype(np.float32)))
    np.testing.assert_array_equal(gains[:2], expected[:2])
    exact = np.stack([g.values for g in interpolate(schedule, tuple(points.T)).gains], axis=-1)
    assert np.max(np.abs(gains - exact)) <= 1e-5 * max(np.max(np.abs(g.values)) for g in schedule.gains)


@pytest.mark.parametrize("flags", [[], ["-DGAINFIELD_FLOAT"]])
def test_nodes_come_back_to_the_last_bit(make_schedule, tmp_path, flags):
    schedule = make_schedule((4, 6))
    nodes = np.stack(np.meshgrid(*(a.values for a in schedule.axes), indexing="ij"), axis=-1).reshape(-1, 2)
    status, gains = Program(tmp_path, schedule).driver(*flags)(nodes)
    assert not np.any(status)
    kind = np.float32 if flags else np.float64
    for column, gain in zip(gains.T, schedule.gains, strict=True):
        np.testing.assert_array_equal(column, gain.values.ravel().astype(kind))


def test_outside_by_every_policy_and_nan(make_schedule, tmp_path):
    schedule = make_schedule((3, 4))
    evaluate = Program(tmp_path, schedule).driver()
    middle = [0.5 * (a.values[0] + a.values[-1]) for a in schedule.axes]
    outside = [[middle[0], -np.inf], [1e308, middle[1]], [-1e3, 1e4]]
    clip, hold, refuse = range(3)
    for policy, expected in ((clip, CLIPPED), (hold, HELD), (refuse, REFUSED)):
        status, gains = evaluate(outside, policy)
        assert set(status) == {expected}
        assert np.all(gains == -77.0) == (policy != clip)
        inside = evaluate([middle], policy)
        assert inside[0] == [0]
        assert np.all(inside[1] != -77.0)
        status, gains = evaluate([[np.nan, middle[1]], [-1e9, np.nan]], policy)
        assert set(status) == {NOT_A_NUMBER}
        assert np.all(gains == -77.0)


def test_says_when_a_filled_point_carries_weight(make_schedule, tmp_path):
    schedule = make_schedule((3, 4), failed=[(0, 0), (1, 2)])
    complete = filled(schedule, "nearest_ok").complete
    points = points_around(schedule, 60)
    points = np.vstack([points, [[schedule.axes[0].values[1], schedule.axes[1].values[1]]]])
    status, gains = Program(tmp_path, schedule, "nearest_ok").driver()(points)
    spoilt = np.isnan(interpolate(schedule, tuple(points.T)).gains[0].values)
    np.testing.assert_array_equal(status & FILLED == FILLED, spoilt)
    assert 0 < np.count_nonzero(spoilt) < len(points)
    expected = interpolate(complete, tuple(points.T))
    np.testing.assert_array_equal(status & CLIPPED, expected.clipped)
    for column, gain in zip(gains.T, expected.gains, strict=True):
        np.testing.assert_allclose(column, gain.values, rtol=1e-15, atol=0)


@pytest.mark.parametrize("flags", [[], ["-DGAINFIELD_FLOAT"], ["-O3", "-funroll-loops"]])
@pytest.mark.parametrize("shape", [(4, 6), (1, 3), (30, 20), (2, 3, 4)])
def test_self_test_passes(make_schedule, tmp_path, flags, shape):
    program = Program(tmp_path, make_schedule(shape, failed=[(0,) * len(shape)]), "nearest_ok")
    program.compile("-DGAINFIELD_SELF_TEST", *flags, program.source, "-o", "self_test")
    done = program.run("self_test")
    assert done.returncode == 0
    assert re.fullmatch(r"\d+ vectors, 0 failures\n", done.stdout)


@pytest.mark.parametrize("flags", [[], ["-DGAINFIELD_FLOAT"]])
def test_self_test_finds_a_wrong_table(make_schedule, tmp_path, flags):
    """A number of the table off by a part in a thousand, and a breakpoint moved."""
    schedule = make_schedule((3, 4))
    for value, off in ((schedule.gains[0].values[1, 1], 1.001), (schedule.axes[0].values[1], 1.02)):
        program = Program(tmp_path, schedule)
        text = (tmp_path / program.source).read_text()
        number = f"R({float(value)!r})"
        (tmp_path / program.source).write_text(text.replace(number, f"R({float(value) * off!r})", 1))
        program.compile("-DGAINFIELD_SELF_TEST", *flags, program.source, "-o", "self_test")
        done = program.run("self_test")
        assert done.returncode == 1
        assert "gain" in done.stdout


def test_hostile_texts_stay_in_their_comments(make_schedule, tmp_path):
    schedule = hostile(make_schedule((2, 3), failed=[(1, 2)]))
    program = Program(tmp_path, schedule, "hold_neighbour")
    assert program.prefix == "rate_loop_2"
    program.compile("-Wcomment", "-Wtrigraphs", "-DGAINFIELD_SELF_TEST", program.source, "-o", "self_test")
    assert program.run("self_test").returncode == 0
    text = (tmp_path / program.header).read_bytes()
    assert text.isascii()
    assert b" * law: u = -K [x, 'y'] *\\x2f /\\x2a" in text
    (tmp_path / "names.c").write_text(
        f'#include <stdio.h>\n#include "{program.header}"\n'
        "int main(void) { fwrite(RATE_LOOP_2_DESIGN_ID, 1, sizeof RATE_LOOP_2_DESIGN_ID - 1, stdout); return 0; }\n"
    )
    program.compile("names.c", "-o", "names")
    done = subprocess.run([tmp_path / "names"], capture_output=True, check=True)
    assert done.stdout.decode() == schedule.provenance.design_id
    for name in NAMES:
        assert f"rate_loop_2_real {name};".encode() in text


@pytest.mark.parametrize("standard", ["-std=c++98", "-std=c++17"])
def test_header_is_included_from_cpp(make_schedule, tmp_path, standard):
    program = Program(tmp_path, make_schedule((2, 3)))
    program.compile("-c", program.source, "-o", "schedule.o")
    (tmp_path / "main.cpp").write_text(
        f'#include "{program.header}"\n#include "{program.header}"\n'
        "int main() { main_condition at = {200.0, 300.0}; main_gains gains;\n"
        "return main_evaluate(&at, MAIN_CLIP, &gains) < 0; }\n"
    )
    program.compile(standard, "main.cpp", "schedule.o", "-o", "cpp", name="g++")
    assert program.run("cpp").returncode == 0


def test_mixed_precisions_do_not_link(make_schedule, tmp_path):
    program = Program(tmp_path, make_schedule((2, 3)))
    program.driver()
    program.compile("-DGAINFIELD_FLOAT", "-c", program.source, "-o", "single.o")
    done = program.compile("driver.c", "single.o", "-o", "mixed", check=False)
    assert done.returncode != 0
    assert "main_evaluate" in done.stderr


def test_source_refuses_the_header_of_another_schedule(make_schedule, tmp_path):
    program = Program(tmp_path, make_schedule((2, 3)))
    other = make_schedule((2, 3), seed=1)
    (tmp_path / program.header).write_bytes(write_schedule(other, "h"))
    done = program.compile("-c", program.source, check=False)
    assert "this source and its header are of different schedules" in done.stderr


@pytest.mark.parametrize(
    ("axis", "factor"), [((1000.0, 1000.0000001), 1.0), ((0.0, 1e39), 1.0), ((0.0, 1.0), 1e200), ((0.0, 1.0), 1e-200)]
)
def test_single_precision_is_refused_where_it_loses_the_table(make_schedule, tmp_path, axis, factor):
    schedule = make_schedule((2, 3))
    gains = tuple(replace(gain, values=gain.values * factor) for gain in schedule.gains)
    schedule = replace(schedule, axes=(GridAxis("altitude", "m", axis), schedule.axes[1]), gains=gains)
    program = Program(tmp_path, schedule)
    program.compile("-DGAINFIELD_SELF_TEST", program.source, "-o", "self_test")
    assert program.run("self_test").returncode == 0
    done = program.compile("-DGAINFIELD_FLOAT", "-c", program.source, check=False)
    assert "are lost in single precision" in done.stderr


def test_refuses_a_build_that_does_not_see_nan(make_schedule, tmp_path):
    program = Program(tmp_path, make_schedule((2, 3)))
    done = program.compile("-ffast-math", "-c", program.source, check=False)
    assert "build without -ffinite-math-only" in done.stderr


def test_nothing_is_allocated(make_schedule, tmp_path):
    program = Program(tmp_path, make_schedule((2, 3)))
    program.compile("-O1", "-c", program.source, "-o", "schedule.o")
    done = subprocess.run([compiler("nm"), "-u", tmp_path / "schedule.o"], capture_output=True, text=True, check=True)
    assert set(re.findall(r"U (\w+)", done.stdout)) <= {"memset", "memcpy", "__stack_chk_fail", "_GLOBAL_OFFSET_TABLE_"}


@pytest.mark.parametrize("suffix", ["h", "c"])
def test_refuses_what_has_no_place_in_c(make_schedule, suffix):
    with pytest.raises(ValueError, match="without axes or without gains is no table"):
        write_schedule(make_schedule(()), suffix)
    schedule = make_schedule((2, 3))
    gains = (replace(schedule.gains[0], name="register"), *schedule.gains[1:])
    with pytest.raises(ValueError, match="'register' is a word of C"):
        write_schedule(replace(schedule, gains=gains), suffix)
