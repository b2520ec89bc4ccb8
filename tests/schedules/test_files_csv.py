import csv
import io
import itertools

import numpy as np
import pytest

from schedules.files import read_csv, write_schedule

SHAPES = [
    ((), ()),
    ((5,), [(1,)]),
    ((4, 6), [(0, 0), (2, 3)]),
    ((4, 6), []),
    ((1, 6), [(0, 2)]),
    ((4, 1), []),
    ((1, 1), [(0, 0)]),
    ((2, 3, 4), [(1, 1, 1)]),
]


@pytest.fixture
def content(make_schedule):
    return write_schedule(make_schedule((2, 3), failed=[(1, 2)]), "csv")


@pytest.mark.parametrize(("shape", "failed"), SHAPES)
@pytest.mark.parametrize("kind", ["positive_feedback", "lqr"])
def test_reads_back_the_same_schedule(make_schedule, same_schedule, shape, failed, kind):
    schedule = make_schedule(shape, kind=kind, failed=failed)
    content = write_schedule(schedule, "csv")
    same_schedule(read_csv(content), schedule)
    assert write_schedule(read_csv(content), "csv") == content


def test_one_row_a_point_last_axis_fastest(make_schedule, content):
    schedule = make_schedule((2, 3), failed=[(1, 2)])
    lines = [line for line in content.decode().splitlines() if not line.startswith("#")]
    rows = list(csv.DictReader(io.StringIO("\n".join(lines))))
    assert list(rows[0]) == ["altitude_m", "dynamic_pressure_pa", "outcome", "K_p", "K_d", "K_i"]
    points = itertools.product(*(axis.values for axis in schedule.axes))
    for row, point, index in zip(rows, points, np.ndindex(2, 3), strict=True):
        assert (float(row["altitude_m"]), float(row["dynamic_pressure_pa"])) == point
        assert row["outcome"] == ("infeasible" if index == (1, 2) else "ok")
        for gain in schedule.gains:
            assert row[gain.name] == ("" if index == (1, 2) else repr(float(gain.values[index])))


def test_comment_lines_say_what_it_is(make_schedule, content):
    schedule = make_schedule((2, 3), failed=[(1, 2)])
    lines = content.decode("ascii").splitlines()
    comments = [line for line in lines if line.startswith("#")]
    assert lines[: len(comments)] == comments
    assert f"# header_lines: {len(comments)}" in comments
    assert "# schema_version: 1" in comments
    assert f'# design_id: "{schedule.provenance.design_id}"' in comments
    assert f'# request_digest: "{schedule.provenance.request_digest}"' in comments
    assert f'# law: "{schedule.law}"' in comments
    assert '# out_of_range: "clipped to the grid\'s edges"' in comments
    assert any(line.startswith("# sign_convention: ") for line in comments)
    assert '# units: {"altitude_m": "m", "dynamic_pressure_pa": "Pa", "K_p": "1", "K_d": "s", "K_i": "1/s"}' in comments
    assert '# reason [1, 2]: "gain margin 4.1 dB, \\"short\\", at (1, 2)"' in comments


def test_numpy_reads_it(make_schedule, content):
    schedule = make_schedule((2, 3), failed=[(1, 2)])
    skip = sum(line.startswith(b"#") for line in content.splitlines())
    table = np.genfromtxt(
        io.BytesIO(content), delimiter=",", skip_header=skip, names=True, dtype=None, encoding="ascii"
    )
    assert table["outcome"].tolist() == ["ok"] * 5 + ["infeasible"]
    np.testing.assert_array_equal(table["K_i"].reshape(2, 3), schedule.gains[2].values)
    np.testing.assert_array_equal(np.unique(table["altitude_m"]), schedule.axes[0].values)


@pytest.mark.octave
@pytest.mark.parametrize("kind", ["negative_feedback", "lqr"])
def test_octave_reads_it(make_schedule, octave, tmp_path, kind):
    schedule = make_schedule((4, 6), kind=kind, failed=[(0, 0), (2, 3), (3, 5)])
    (tmp_path / "schedule.csv").write_bytes(write_schedule(schedule, "csv"))
    numbers = octave(f"""
        text = fileread("schedule.csv");
        skip = str2double(regexp(text, "header_lines: (\\\\d+)", "tokens"){{1}}{{1}});
        file = fopen("schedule.csv");
        columns = textscan(file, ["%f %f %s" repmat(" %f", 1, {len(schedule.gains)})], ...
                           "Delimiter", ",", "HeaderLines", skip + 1, "EmptyValue", NaN);
        fclose(file);
        printf("%d\\n", strcmp(columns{{3}}, "ok"));
        printf("%.17g\\n", columns{{[1 2 4:end]}});
    """)
    ok, table = numbers[:24], numbers[24:].reshape(-1, 24)
    np.testing.assert_array_equal(ok.reshape(4, 6), schedule.outcomes.ok)
    grid = np.meshgrid(*(axis.values for axis in schedule.axes), indexing="ij")
    for column, expected in zip(table, [*grid, *(gain.values for gain in schedule.gains)], strict=True):
        # Octave's textscan itself is wrong in the last places of some numbers.
        np.testing.assert_allclose(column.reshape(4, 6), expected, rtol=1e-15)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (b"# format: ", b"# form: ", "not a schedule file"),
        (b"schema_version: 1", b"schema_version: 9", "schema_version is 9"),
        (b"schema_version: 1", b"schema_version: one", "holds JSON"),
        (b"# units: ", b"# unit: ", "'units' must name"),
        (b'"K_d": "s", ', b"", "'units' must name"),
        (b"# reason [1, 2]", b"# reason [1, 3]", "outside the grid"),
        (b"# reason [1, 2]", b"# reason 1", "list of indices"),
        (b"# reason [1, 2]", b"# reason [0, 0]", "a point that is ok has no reason"),
        (b"# reason [1, 2]: ", b"# reason [0, 0]: 5\n# reason [1, 2]: ", "a reason is text"),
        (b"# reason [1, 2]", b'# reason ["a"]', "list of indices"),
        (b",outcome,", b",outcomes,", "one of them 'outcome'"),
        (b",K_d,", b",K_p,", "different names"),
        (b",infeasible,", b",impossible,", "not a valid Outcome"),
        (b",infeasible,,", b",infeasible,", "row 6 has 5 cells for 6 columns"),
        (b",infeasible,,", b",infeasible,1.0,", "whose outcome is infeasible"),
        (b",infeasible,,", b",infeasible,x,", "column K_p: could not convert"),
        (b",infeasible,,", b',infeasible,"a"b,', "not comma-separated values"),
        (b"\n# kind: ", b"\n#\n# kind: ", "holds JSON"),
    ],
)
def test_refuses_what_does_not_fit(content, old, new, message):
    assert content.count(old) == 1
    with pytest.raises(ValueError, match=message):
        read_csv(content.replace(old, new))


def test_refuses_rows_that_are_not_the_whole_grid(content):
    lines = content.splitlines()
    with pytest.raises(ValueError, match="5 rows are not a whole grid"):
        read_csv(b"\n".join(lines[:-1]))
    with pytest.raises(ValueError, match="row-major order"):
        read_csv(b"\n".join([*lines[:-2], lines[-1], lines[-2]]))


@pytest.mark.parametrize("content", [b"", b"a,b\n1,2\n", b"\xff\xfe", b"# " + b"[" * 100_000, b'# format: "x"'])
def test_refuses_what_is_no_schedule(content):
    with pytest.raises(ValueError, match=r"."):
        read_csv(content)
