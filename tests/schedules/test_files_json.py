import json

import numpy as np
import pytest

from schedules.files import FILE_FORMATS, MissingGains, read_json, write_schedule
from schedules.fill import FILL_RULES
from schedules.rules import INTERPOLATIONS, OUTS_OF_RANGE
from schedules.schedule import SCHEMA_VERSION, SIGN_CONVENTION

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


@pytest.mark.parametrize(("shape", "failed"), SHAPES)
@pytest.mark.parametrize("kind", ["positive_feedback", "lqr"])
def test_reads_back_the_same_schedule(make_schedule, same_schedule, shape, failed, kind):
    schedule = make_schedule(shape, kind=kind, failed=failed)
    content = write_schedule(schedule, "json")
    same_schedule(read_json(content), schedule)
    assert write_schedule(read_json(content), "json") == content


def test_numbers_survive_to_the_last_bit(make_schedule, same_schedule):
    schedule = make_schedule((2, 3))
    extreme = np.array([[5e-324, -0.0, 1.7976931348623157e308], [0.1, 1 / 3, -(2.0**-1022)]])
    gains = tuple(type(g)(g.name, g.unit, extreme) for g in schedule.gains)
    schedule = type(schedule)(**{**vars(schedule), "gains": gains})
    same_schedule(read_json(write_schedule(schedule, "json")), schedule)


def test_says_what_it_is(make_schedule):
    schedule = make_schedule((2, 3), failed=[(1, 2)])
    document = json.loads(write_schedule(schedule, "json"))
    assert document["schema_version"] == 1 < SCHEMA_VERSION == 2
    assert document["design_id"] == schedule.provenance.design_id
    assert document["request_digest"] == schedule.provenance.request_digest
    assert (document["controller"], document["kind"], document["law"]) == (
        "main",
        "negative_feedback",
        schedule.law,
    )
    assert document["sign_convention"] == SIGN_CONVENTION
    assert document["interpolation"] == INTERPOLATIONS["multilinear"]
    assert document["out_of_range"] == OUTS_OF_RANGE["clip"]
    assert [axis["name"] for axis in document["axes"]] == ["altitude_m", "dynamic_pressure_pa"]
    assert document["axes"][1]["values"] == list(schedule.axes[1].values)
    assert document["gains"][1]["name"] == "K_d"
    assert document["gains"][1]["unit"] == "s"
    assert document["gains"][1]["values"][1][2] is None
    assert document["gains"][1]["values"][0][2] == schedule.gains[1].values[0, 2]
    assert document["outcomes"] == [["ok"] * 3, ["ok", "ok", "infeasible"]]
    assert document["reasons"][1][2] == 'gain margin 4.1 dB, "short", at (1, 2)'


def test_media_types():
    assert {f.suffix: f.media_type for f in FILE_FORMATS.values()} == {
        "json": "application/json",
        "csv": "text/csv; charset=utf-8",
        "mat": "application/x-matlab-data",
        "npz": "application/x-npz",
        "h5": "application/x-hdf5",
        "h": "text/x-chdr; charset=utf-8",
        "c": "text/x-csrc; charset=utf-8",
        "m": "text/x-matlab; charset=utf-8",
        "xml": "application/xml",
        "dml": "application/xml",
    }


@pytest.mark.parametrize("suffix", FILE_FORMATS)
def test_same_schedule_same_bytes(make_schedule, suffix):
    fill = None if FILE_FORMATS[suffix].says_missing else "nearest_ok"
    first, second = (write_schedule(make_schedule((4, 6), failed=[(1, 2)]), suffix, fill) for _ in range(2))
    assert first == second
    assert first != write_schedule(make_schedule((4, 6), failed=[(1, 2)], seed=1), suffix, fill)


@pytest.mark.parametrize("suffix", FILE_FORMATS)
def test_missing_gains_are_said_or_filled_by_a_named_rule(make_schedule, suffix):
    schedule = make_schedule((2, 3), failed=[(1, 2)])
    if FILE_FORMATS[suffix].says_missing:
        with pytest.raises(ValueError, match=f"a {suffix} file says where there is no gain: it takes no fill rule"):
            write_schedule(schedule, suffix, "nearest_ok")
        return
    with pytest.raises(MissingGains, match="no gains at 1 of 6 points"):
        write_schedule(schedule, suffix)
    with pytest.raises(ValueError, match="no fill rule 'zeros'"):
        write_schedule(schedule, suffix, "zeros")
    nearest, held = (write_schedule(schedule, suffix, rule) for rule in FILL_RULES)
    assert nearest != held
    assert b"nearest_ok: a point that is not ok has all gains of the nearest ok point" in nearest
    assert b"hold_neighbour: a point that is not ok has all gains of the nearest ok point along" in held
    assert b"filled_point [1, 2]: infeasible, gains of point [1, 1]; gain margin 4.1 dB" in held
    complete = make_schedule((2, 3))
    assert write_schedule(complete, suffix, "nearest_ok") == write_schedule(complete, suffix)
    assert b"none: every point of the grid is ok" in write_schedule(complete, suffix)


@pytest.mark.parametrize("suffix", FILE_FORMATS)
def test_every_file_says_what_it_is(make_schedule, suffix):
    """The same words in every format; those of archives and MAT-files are read in the tests of these."""
    if suffix in ("mat", "npz", "h5"):
        return
    schedule = make_schedule((2, 3))
    text = write_schedule(schedule, suffix).decode("ascii")
    words = [schedule.law, SIGN_CONVENTION, INTERPOLATIONS["multilinear"], OUTS_OF_RANGE["clip"], "negative_feedback"]
    words += [schedule.provenance.design_id, schedule.provenance.request_digest, schedule.provenance.created_at]
    for word in [*words, "schema_version", "altitude_m", "dynamic_pressure_pa"]:
        assert word in text or word.replace("'", "''") in text, word


def test_unknown_format_lists_those_there_are(make_schedule):
    with pytest.raises(ValueError, match="'xls'; there are: json, csv, mat, npz, h5, h, c, m, xml, dml"):
        write_schedule(make_schedule(), "xls")


def spoilt(document, path, value):
    *way, last = path
    place = document
    for step in way:
        place = place[step]
    place[last] = value
    return json.dumps(document).encode()


@pytest.mark.parametrize(
    ("path", "value", "message"),
    [
        (("format",), "other", "not a schedule file"),
        (("schema_version",), 9, "schema_version is 9"),
        (("schema_version",), True, "schema_version is True"),
        (("design_id",), None, "design_id must be text"),
        (("kind",), "pid", "kind is 'pid'"),
        (("interpolation",), "nearest", "interpolation is 'nearest'"),
        (("out_of_range",), "extrapolated", "out_of_range is 'extrapolated'"),
        (("axes",), {}, "/axes: expected a list"),
        (("axes", 0, "values"), [], "finite and strictly increasing|expected 0 entries"),
        (("axes", 0, "values", 1), 1e-9, "strictly increasing"),
        (("axes", 0, "values", 1), "1", "/axes/0/values/1: expected a number"),
        (("axes", 0, "values", 1), 10**400, "too large"),
        (("axes", 0, "unit"), "ft", "unit 'ft' has no suffix"),
        (("axes", 0, "name"), "altitude", "does not end in '_m'"),
        (("axes", 1), 5, "/axes/1/unit: expected text"),
        (("gains", 0, "values", 1), [1.0], "/gains/0/values/1: expected 3 entries"),
        (("gains", 0, "values", 0, 0), True, "expected a number"),
        (("gains", 0, "values", 0, 0), None, r"K_p is nan at point \(0, 0\), whose outcome is ok"),
        (("gains", 0, "values", 1, 2), 4.0, r"K_p is 4.0 at point \(1, 2\), whose outcome is infeasible"),
        (("gains", 0, "name"), "1x", "cannot be the name"),
        (("gains", 0, "name"), "K_i", "must differ"),
        (("gains", 0, "name"), "ok", "cannot be the name"),
        (("outcomes", 0, 0), "fine", "not a valid Outcome"),
        (("outcomes", 0, 0), [], "not a valid Outcome"),
        (("reasons", 0, 0), "why", "a point that is ok has no reason"),
        (("reasons", 0, 0), 3, "/reasons: expected text or null"),
    ],
)
def test_refuses_what_does_not_fit(make_schedule, path, value, message):
    document = json.loads(write_schedule(make_schedule((2, 3), failed=[(1, 2)]), "json"))
    with pytest.raises(ValueError, match=message):
        read_json(spoilt(document, path, value))


@pytest.mark.parametrize(
    "content", [b"", b"[]", b"{}", b"{", b"\xff\xfe", b"[" * 100_000, b'{"format": NaN}', b'"\xed\xa0\x80"']
)
def test_refuses_what_is_no_schedule(content):
    with pytest.raises(ValueError, match=r"."):
        read_json(content)


@pytest.mark.parametrize("number", [b"NaN", b"Infinity", b"1e999"])
def test_refuses_numbers_that_are_not_finite(make_schedule, number):
    content = write_schedule(make_schedule((2, 3)), "json")
    first = repr(float(make_schedule((2, 3)).gains[0].values[0, 0])).encode()
    assert content.count(first) == 1
    with pytest.raises(ValueError, match=r"not JSON|K_p is inf"):
        read_json(content.replace(first, number))


@pytest.mark.parametrize("value", [np.nan, np.inf])
@pytest.mark.parametrize("suffix", FILE_FORMATS)
def test_never_writes_a_number_that_is_none_at_an_ok_point(make_schedule, suffix, value):
    schedule = make_schedule((2, 3))
    values = schedule.gains[0].values.copy()
    values[0, 1] = value
    gains = (type(schedule.gains[0])("K_p", "1", values), *schedule.gains[1:])
    with pytest.raises(ValueError, match=r"K_p is (nan|inf) at point \(0, 1\)"):
        write_schedule(type(schedule)(**{**vars(schedule), "gains": gains}), suffix)


def test_never_writes_a_point_without_an_outcome(make_schedule):
    schedule = make_schedule((2, 3), failed=[(1, 2)])
    outcomes = schedule.outcomes.take(schedule.outcomes.ok).spread(schedule.outcomes.ok)
    with pytest.raises(ValueError, match="every point has an outcome"):
        write_schedule(type(schedule)(**{**vars(schedule), "outcomes": outcomes}), "json")
