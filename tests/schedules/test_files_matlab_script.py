"""The MATLAB script, run by GNU Octave; its Simulink part with structs in place of Simulink's objects."""

from dataclasses import replace

import numpy as np
import pytest

from schedules.files import file_name, write_schedule
from schedules.files.matlab_file import gain_matrix
from schedules.files.plain_text import plain
from schedules.fill import filled
from schedules.interpolate import interpolate
from schedules.wire_names import axis_name
from tests.schedules.hostile_schedules import TEXT, hostile, points_around


def installed(folder, schedule, fill=None):
    """Name under which the script is called, once it is in the folder."""
    name = file_name(schedule, "m")
    (folder / name).write_bytes(write_schedule(schedule, "m", fill))
    return name.removesuffix(".m")


def looked_up(schedule, script, points, source=""):
    """Octave: every gain at the points by interpn, coordinates clipped first."""
    rows = "; ".join(" ".join(repr(float(x)) for x in point) for point in points)
    names = [source + axis_name(axis) for axis in schedule.axes]
    lines = [f"{script};", f"x = [{rows}];"]
    for k, name in enumerate(names, start=1):
        lines.append(f"x(:, {k}) = min(max(x(:, {k}), {name}(1)), {name}(end));")
    at = ", ".join(f"x(:, {k})" for k in range(1, len(names) + 1))
    axes = ", ".join(names)
    lines += [f'printf("%.17g\\n", interpn({axes}, {source}{gain.name}, {at}));' for gain in schedule.gains]
    return "\n".join(lines)


def compare(schedule, points, printed):
    expected = interpolate(schedule, tuple(points.T))
    for gain, by_octave in zip(expected.gains, printed.reshape(len(schedule.gains), -1), strict=True):
        scale = np.max(np.abs(gain.values))
        np.testing.assert_allclose(by_octave, gain.values, rtol=1e-12, atol=1e-13 * scale)


@pytest.mark.octave
@pytest.mark.parametrize(("shape", "failed"), [((4, 6), [(1, 2), (3, 5)]), ((2, 3, 4), []), ((12, 30), [(0, 0)])])
def test_interpn_of_the_tables_is_the_schedules_rule(make_schedule, octave, tmp_path, shape, failed):
    schedule = make_schedule(shape, failed=failed)
    script = installed(tmp_path, schedule, "nearest_ok")
    points = points_around(schedule)
    compare(filled(schedule, "nearest_ok").complete, points, octave(looked_up(schedule, script, points)))


@pytest.mark.octave
@pytest.mark.parametrize("shape", [(1, 6), (4, 1), (1, 1), (3, 1, 4)])
def test_lookup_serves_an_axis_of_one_breakpoint(make_schedule, octave, tmp_path, shape):
    schedule = make_schedule(shape)
    script = installed(tmp_path, schedule)
    points = points_around(schedule)
    compare(schedule, points, octave(looked_up(schedule, script, points, "lookup.")))


@pytest.mark.octave
@pytest.mark.parametrize("shape", [(4, 6), (40,), (1, 6), (4, 1), (2, 3, 4)])
def test_numbers_shapes_and_marks(make_schedule, octave, tmp_path, shape):
    """Every number to the last bit, in column-major order as MATLAB keeps it."""
    schedule = make_schedule(shape, kind="lqr", failed=[(0,) * len(shape)])
    script = installed(tmp_path, schedule, "nearest_ok")
    names = [axis_name(a) for a in schedule.axes] + [g.name for g in schedule.gains]
    printed = octave(
        f"gainfield = 3; lookup = 4; {script};"
        + "".join(f'printf("%.17g\\n", {name});' for name in names)
        + 'printf("%d\\n", ok, gainfield.filled, islogical(ok), size(K_T_t_dt), numel(size(K)), size(K, ndims(K)));'
        + 'printf("%d\\n", strcmp(gainfield.outcomes, "ok"), cellfun(@isempty, gainfield.reasons), size(N));'
        + 'printf("%.17g\\n", K, N);'
    )
    complete = filled(schedule, "nearest_ok").complete
    expected = [np.array(axis.values) for axis in schedule.axes]
    expected += [gain.values.ravel(order="F") for gain in complete.gains]
    ok = schedule.outcomes.ok.ravel(order="F")
    size = (1, *shape) if len(shape) == 1 else shape
    expected += [ok, ~ok, [1], size, [len(shape) + 2, 5], ok, ok, (*shape, 2)]
    expected += [gain_matrix(complete, symbol).values.ravel(order="F") for symbol in "KN"]
    np.testing.assert_array_equal(printed, np.concatenate([np.asarray(x, dtype=float).ravel() for x in expected]))


@pytest.mark.octave
def test_the_matrices_hold_the_named_gains(make_schedule, octave, tmp_path):
    schedule = make_schedule((2, 3), kind="lqr")
    script = installed(tmp_path, schedule)
    printed = octave(
        f"{script};"
        'printf("%d\\n", isequal(squeeze(K(:, :, 2, 3)), K_T_a_da), isequal(squeeze(N(:, :, 1)), N_T_t_r_a));'
        'printf("%d\\n", strcmp(gainfield.units.K_T_a_da, "N m/rad"));'
    )
    assert printed.tolist() == [1, 1, 1]


@pytest.mark.octave
@pytest.mark.parametrize("shape", [(2, 3), (1, 3)])
def test_simulink_objects(make_schedule, octave, tmp_path, shape):
    """What is assigned to Simulink's objects, which Octave has not: structs stand in for them."""
    schedule = make_schedule(shape, kind="lqr")
    script = installed(tmp_path, schedule)
    file = tmp_path / f"{script}.m"
    text = file.read_text()
    assert text.count("if exist('Simulink.LookupTable', 'class') == 8") == 1
    text = text.replace("exist('Simulink.LookupTable', 'class') == 8", "true")
    file.write_text(text.replace("Simulink.LookupTable;", "struct();"))
    source = "lookup." if 1 in shape else ""
    printed = octave(
        f"{script}; t = K_T_a_da_rate_lookup;"
        f'printf("%d\\n", isequal(t.Table.Value, {source}K_T_a_da_rate), strcmp(t.Table.Unit, "N*m/rad"));'
        f'printf("%d\\n", isequal(t.Breakpoints(1).Value, {source}altitude_m), numel(t.Breakpoints));'
        f'printf("%d\\n", isequal(t.Breakpoints(2).Value, {source}dynamic_pressure_pa));'
        'printf("%d\\n", strcmp(t.Breakpoints(2).Unit, "Pa"), strcmp(t.StructTypeInfo.Name, "K_T_a_da_rate_table"));'
    )
    assert printed.tolist() == [1, 1, 1, 2, 1, 1, 1]


@pytest.mark.octave
def test_hostile_texts_stay_texts(make_schedule, octave, tmp_path):
    schedule = hostile(make_schedule((2, 3), failed=[(1, 2)]))
    script = installed(tmp_path, schedule, "hold_neighbour")
    assert script.isidentifier()
    printed = octave(
        f'{script}; printf("%d\\n", double(gainfield.law), numel(who), K_T_t_T_t_1(2, 3) == K_T_t_T_t_1(2, 2));'
        'printf("%d\\n", double(gainfield.reasons{2, 3}));'
    )
    text = [ord(c) for c in plain(TEXT)]
    # ok, gainfield and the axes and gains; Octave itself has ans.
    assert printed.tolist() == [*text, 9, 1, *text]
    assert plain(TEXT).encode().decode("unicode_escape") == TEXT


@pytest.mark.parametrize(
    ("name", "message"), [("end", "'end' is a word of MATLAB"), ("K_d_lookup", "'K_d_lookup' cannot be the name")]
)
def test_refuses_names_that_the_script_cannot_use(make_schedule, name, message):
    schedule = make_schedule((2, 3))
    gains = (replace(schedule.gains[0], name=name), *schedule.gains[1:])
    with pytest.raises(ValueError, match=message):
        write_schedule(replace(schedule, gains=gains), "m")
