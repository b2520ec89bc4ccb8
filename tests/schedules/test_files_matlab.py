import io
import time

import numpy as np
import pytest
from scipy.io import loadmat

from schedules.files import write_schedule
from schedules.files.matlab_file import gain_matrix
from schedules.interpolate import interpolate
from schedules.rules import INTERPOLATIONS, OUTS_OF_RANGE
from schedules.schedule import SIGN_CONVENTION


def loaded(schedule, **options):
    return loadmat(io.BytesIO(write_schedule(schedule, "mat")), **options)


@pytest.mark.parametrize(("shape", "failed"), [((4, 6), [(1, 2)]), ((1, 6), []), ((4, 1), []), ((2, 3, 4), [])])
def test_scipy_reads_axes_gains_and_mask(make_schedule, shape, failed):
    schedule = make_schedule(shape, failed=failed)
    content = loaded(schedule)
    for axis, name in zip(schedule.axes, ("altitude_m", "dynamic_pressure_pa", "mach"), strict=False):
        np.testing.assert_array_equal(content[name], [axis.values])
    for gain in schedule.gains:
        np.testing.assert_array_equal(content[gain.name], gain.values)
    np.testing.assert_array_equal(content["ok"], schedule.outcomes.ok)


def test_a_single_point_is_a_scalar(make_schedule):
    schedule = make_schedule(())
    content = loaded(schedule)
    assert content["K_p"] == schedule.gains[0].values
    assert content["ok"] == 1


def test_struct_says_what_it_is(make_schedule):
    schedule = make_schedule((2, 3), failed=[(1, 2)])
    about = loaded(schedule, simplify_cells=True)["gainfield"]
    assert about["schema_version"] == 1
    assert about["design_id"] == schedule.provenance.design_id
    assert about["request_digest"] == schedule.provenance.request_digest
    assert about["created_at"] == schedule.provenance.created_at
    assert (about["controller"], about["kind"], about["law"]) == ("main", "negative_feedback", schedule.law)
    assert about["sign_convention"] == SIGN_CONVENTION
    assert (about["interpolation"], about["out_of_range"]) == (INTERPOLATIONS["multilinear"], OUTS_OF_RANGE["clip"])
    assert about["axes"].tolist() == ["altitude_m", "dynamic_pressure_pa"]
    assert about["units"] == {
        "altitude_m": "m",
        "dynamic_pressure_pa": "Pa",
        "K_p": "1",
        "K_d": "s",
        "K_i": "1/s",
    }
    assert about["outcomes"].tolist() == [["ok"] * 3, ["ok", "ok", "infeasible"]]
    assert about["reasons"][1][2] == 'gain margin 4.1 dB, "short", at (1, 2)'


def test_bytes_do_not_depend_on_the_clock(make_schedule, monkeypatch):
    first = write_schedule(make_schedule(), "mat")
    monkeypatch.setattr(time, "asctime", lambda *_: "Thu Jan  1 00:00:00 1970")
    assert write_schedule(make_schedule(), "mat") == first
    assert first.startswith(b"MATLAB 5.0 MAT-file, gainfield gain schedule, schema version 1 ")
    assert first[124:128] == b"\x00\x01IM"


def test_lqr_matrices_hold_the_named_gains(make_schedule):
    schedule = make_schedule((2, 3), kind="lqr", failed=[(1, 2)])
    content = loaded(schedule, simplify_cells=True)
    assert content["K"].shape == (2, 3, 2, 5)
    rows, columns = content["gainfield"]["K_rows"].tolist(), content["gainfield"]["K_columns"].tolist()
    assert (rows, columns) == (["T_t", "T_a"], ["dt", "dt_rate", "da", "da_rate", "int_a"])
    for i, row in enumerate(rows):
        for j, column in enumerate(columns):
            np.testing.assert_array_equal(content["K"][..., i, j], content[f"K_{row}_{column}"])
        np.testing.assert_array_equal(loaded(schedule)["N"][..., i, 0], content[f"N_{row}_r_a"])


def test_matrices_of_a_point_are_those_of_the_grid(make_schedule):
    schedule = make_schedule((2, 3), kind="lqr")
    for symbol in ("K", "N"):
        whole = gain_matrix(schedule, symbol).values
        for index in np.ndindex(2, 3):
            gains = tuple(gain.take(index) for gain in schedule.gains)
            point = type(schedule)(
                **{**vars(schedule), "axes": (), "gains": gains, "outcomes": schedule.outcomes.take(index)}
            )
            np.testing.assert_array_equal(gain_matrix(point, symbol).values, whole[index])


def test_no_matrix_without_every_entry_or_for_another_kind(make_schedule):
    schedule = make_schedule((2, 3), kind="lqr")
    gains = tuple(g for g in schedule.gains if g.name != "K_T_a_da")
    assert gain_matrix(type(schedule)(**{**vars(schedule), "gains": gains}), "K") is None
    assert gain_matrix(make_schedule((2, 3)), "K") is None
    assert "K" not in loaded(make_schedule((2, 3)))


OCTAVE = """
    load schedule.mat
    table = {source};
    points = [{points}];
    for k = 1:{axes}
      breakpoints = table.(gainfield.axes{{k}});
      clamped{{k}} = min(max(points(:, k), breakpoints(1)), breakpoints(end));
      axes_of_table{{k}} = breakpoints;
    end
    names = {{{names}}};
    for n = 1:numel(names)
      printf("%.17g\\n", interpn(axes_of_table{{:}}, table.(names{{n}}), clamped{{:}}));
      {also}
    end
"""

#: The same by interp2, whose first coordinate runs along the columns.
INTERP2 = 'printf("%.17g\\n", interp2(axes_of_table{[2 1]}, table.(names{n}), clamped{[2 1]}));'


def octave_script(schedule, points, source, also=""):
    rows = "; ".join(" ".join(repr(float(x)) for x in point) for point in points)
    names = ", ".join(f'"{gain.name}"' for gain in schedule.gains)
    return OCTAVE.format(source=source, points=rows, names=names, axes=len(schedule.axes), also=also)


def points_in_and_around(schedule, count=20, seed=3):
    rng = np.random.default_rng(seed)
    edges = np.array([(a.values[0], a.values[-1]) for a in schedule.axes])
    span = np.maximum(edges[:, 1] - edges[:, 0], 1.0)
    points = rng.uniform(edges[:, 0] - 0.4 * span, edges[:, 1] + 0.4 * span, (count, len(edges)))
    outside = interpolate(schedule, tuple(points.T)).clipped
    assert np.any(outside)
    return points


@pytest.mark.octave
@pytest.mark.parametrize("kind", ["negative_feedback", "lqr"])
def test_octave_interpolates_as_the_schedule_does(make_schedule, octave, tmp_path, kind):
    schedule = make_schedule((4, 6), kind=kind)
    points = points_in_and_around(schedule)
    assert not np.all(interpolate(schedule, tuple(points.T)).clipped)
    (tmp_path / "schedule.mat").write_bytes(write_schedule(schedule, "mat"))
    script = octave_script(schedule, points, 'load("schedule.mat")', INTERP2)
    printed = octave(script).reshape(len(schedule.gains), 2, len(points))
    expected = interpolate(schedule, tuple(points.T))
    for gain, by_octave, original in zip(expected.gains, printed, schedule.gains, strict=True):
        scale = np.max(np.abs(original.values))
        np.testing.assert_allclose(by_octave[0], gain.values, rtol=1e-12, atol=1e-14 * scale)
        np.testing.assert_allclose(by_octave[1], gain.values, rtol=1e-12, atol=1e-14 * scale)


@pytest.mark.octave
def test_octave_has_no_gain_where_the_schedule_has_none(make_schedule, octave, tmp_path):
    """Inside the cells both agree, nan included; on grid lines, which are left out, interpn may spread it."""
    schedule = make_schedule((4, 6), failed=[(1, 2), (3, 5)])
    points = points_in_and_around(schedule, 60)
    inside = points[~interpolate(schedule, tuple(points.T)).clipped]
    (tmp_path / "schedule.mat").write_bytes(write_schedule(schedule, "mat"))
    printed = octave(octave_script(schedule, inside, 'load("schedule.mat")')).reshape(3, -1)
    for gain, by_octave in zip(interpolate(schedule, tuple(inside.T)).gains, printed, strict=True):
        assert 0 < np.count_nonzero(np.isnan(gain.values)) < len(inside)
        np.testing.assert_allclose(by_octave, gain.values, rtol=1e-12, equal_nan=True)


@pytest.mark.octave
@pytest.mark.parametrize("shape", [(1, 6), (4, 1), (1, 1), (3, 1, 4), (3, 4, 1)])
def test_octave_interpolates_a_grid_with_an_axis_of_one_breakpoint(make_schedule, octave, tmp_path, shape):
    schedule = make_schedule(shape)
    points = points_in_and_around(schedule)
    (tmp_path / "schedule.mat").write_bytes(write_schedule(schedule, "mat"))
    printed = octave(octave_script(schedule, points, "lookup")).reshape(3, -1)
    for gain, by_octave, original in zip(
        interpolate(schedule, tuple(points.T)).gains, printed, schedule.gains, strict=True
    ):
        scale = np.max(np.abs(original.values))
        np.testing.assert_allclose(by_octave, gain.values, rtol=1e-12, atol=1e-14 * scale)


@pytest.mark.octave
def test_octave_sees_sizes_mask_and_words(make_schedule, octave, tmp_path):
    schedule = make_schedule((4, 6), kind="lqr", failed=[(1, 2)])
    (tmp_path / "schedule.mat").write_bytes(write_schedule(schedule, "mat"))
    printed = octave("""
        load schedule.mat
        printf("%d\\n", size(K), size(N), size(ok), islogical(ok), ok(2, 3), sum(ok(:)));
        printf("%d\\n", isequaln(squeeze(K(:, :, 2, 3)), K_T_a_da), strcmp(gainfield.K_columns{3}, "da"));
        printf("%d\\n", strcmp(gainfield.outcomes{2, 3}, "infeasible"), isempty(gainfield.reasons{1, 1}));
        printf("%d\\n", strcmp(gainfield.units.K_T_a_da, "N m/rad"));
        printf("%d\\n", double(gainfield.design_name));
    """)
    name = [ord(c) for c in 'wind, "tunnel" # Fl\\xfcgel\n\\U0001f680']
    assert printed.tolist() == [4, 6, 2, 5, 4, 6, 2, 4, 6, 1, 0, 23, 1, 1, 1, 1, 1, *name]
