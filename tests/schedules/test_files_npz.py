import io
import json
import time
import zipfile

import numpy as np
import pytest

from schedules.files import read_npz, write_schedule
from schedules.rules import INTERPOLATIONS, OUTS_OF_RANGE
from schedules.schedule import SIGN_CONVENTION
from tests.schedules.hostile_schedules import hostile

SHAPES = [((), ()), ((), [()]), ((5,), [(1,)]), ((4, 6), [(0, 0), (2, 3)]), ((1, 6), []), ((2, 3, 4), [(1, 1, 1)])]


@pytest.mark.parametrize(("shape", "failed"), SHAPES)
@pytest.mark.parametrize("kind", ["positive_feedback", "lqr"])
def test_reads_back_the_same_schedule(make_schedule, same_schedule, shape, failed, kind):
    schedule = make_schedule(shape, kind=kind, failed=failed)
    content = write_schedule(schedule, "npz")
    same_schedule(read_npz(content), schedule)
    assert write_schedule(read_npz(content), "npz") == content


def test_texts_and_extreme_numbers_come_back(make_schedule, same_schedule):
    schedule = hostile(make_schedule((2, 3), failed=[(1, 2)]))
    same_schedule(read_npz(write_schedule(schedule, "npz")), schedule)
    schedule = make_schedule((2, 3))
    extreme = np.array([[5e-324, -0.0, 1.7976931348623157e308], [0.1, 1 / 3, -(2.0**-1022)]])
    gains = tuple(type(g)(g.name, g.unit, extreme) for g in schedule.gains)
    schedule = type(schedule)(**{**vars(schedule), "gains": gains})
    same_schedule(read_npz(write_schedule(schedule, "npz")), schedule)


def test_numpy_reads_it_without_pickle(make_schedule):
    schedule = make_schedule((2, 3), failed=[(1, 2)])
    with np.load(io.BytesIO(write_schedule(schedule, "npz")), allow_pickle=False) as archive:
        arrays = {name: archive[name] for name in archive.files}
    assert list(arrays) == ["altitude_m", "dynamic_pressure_pa", "K_p", "K_d", "K_i", "ok", "outcome", "gainfield"]
    np.testing.assert_array_equal(arrays["K_d"], schedule.gains[1].values)
    np.testing.assert_array_equal(arrays["altitude_m"], schedule.axes[0].values)
    np.testing.assert_array_equal(arrays["ok"], schedule.outcomes.ok)
    assert arrays["outcome"].tolist() == [["ok"] * 3, ["ok", "ok", "infeasible"]]
    about = json.loads(str(arrays["gainfield"]))
    assert (about["sign_convention"], about["interpolation"]) == (SIGN_CONVENTION, INTERPOLATIONS["multilinear"])
    assert (about["out_of_range"], about["schema_version"]) == (OUTS_OF_RANGE["clip"], 1)
    assert about["units"]["K_i"] == "1/s"
    assert about["request_digest"] == schedule.provenance.request_digest


def test_bytes_do_not_depend_on_the_clock(make_schedule, monkeypatch):
    first = write_schedule(make_schedule(), "npz")
    monkeypatch.setattr(time, "localtime", lambda *_: time.gmtime(1e9))
    monkeypatch.setattr(time, "time", lambda: 1e9)
    assert write_schedule(make_schedule(), "npz") == first
    with zipfile.ZipFile(io.BytesIO(first)) as archive:
        assert {member.date_time for member in archive.infolist()} == {(1980, 1, 1, 0, 0, 0)}
        assert archive.testzip() is None


def changed(content, changes, about=None):
    """The archive with some arrays replaced (None: left out) and words of its document changed."""
    with np.load(io.BytesIO(content)) as archive:
        arrays = {name: archive[name] for name in archive.files}
    if about is not None:
        arrays["gainfield"] = np.array(json.dumps(json.loads(str(arrays["gainfield"])) | about))
    arrays |= changes
    out = io.BytesIO()
    np.savez(out, **{name: array for name, array in arrays.items() if array is not None})
    return out.getvalue()


@pytest.mark.parametrize(
    ("changes", "about", "message"),
    [
        ({"gainfield": None}, None, "it has no gainfield"),
        ({"gainfield": np.array("[" * 100_000)}, None, "nested too deeply"),
        ({"gainfield": np.array("[]")}, None, "not an object"),
        ({"gainfield": np.array("{")}, None, "Expecting"),
        ({"gainfield": np.array({}, dtype=object)}, None, "allow_pickle"),
        ({}, {"format": "x"}, "its format is not"),
        ({}, {"schema_version": 9}, "schema_version is 9"),
        ({}, {"units": None}, "units an object"),
        ({}, {"axes": "altitude_m"}, "axes must be a list"),
        ({}, {"gains": ["K_x"]}, "gains must be names that have a unit"),
        ({}, {"gains": [3]}, "gains must be names that have a unit"),
        ({}, {"law": 3}, "law must be text"),
        ({}, {"reasons": [None]}, "reasons must be a list of 6"),
        ({}, {"reasons": [3] * 6}, "a reason must be text or null"),
        ({"K_p": None}, None, "it has no K_p"),
        ({"outcome": None}, None, "it has no outcome"),
        ({"K_p": np.zeros((2, 3), dtype=int)}, None, "K_p must hold numbers in double precision"),
        ({"K_p": np.zeros((3, 2))}, None, "K_p has shape"),
        ({"K_p": np.ones((2, 3))}, None, "whose outcome is infeasible"),
        ({"outcome": np.full((2, 3), "fine")}, None, "not a valid Outcome"),
        ({"altitude_m": np.array([2.0, 1.0])}, None, "strictly increasing"),
    ],
)
def test_refuses_what_does_not_fit(make_schedule, changes, about, message):
    content = write_schedule(make_schedule((2, 3), failed=[(1, 2)]), "npz")
    with pytest.raises(ValueError, match=message):
        read_npz(changed(content, changes, about))


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04", b"\x93NUMPY", b"x" * 200, b"PK\x05\x06" + bytes(18)])
def test_refuses_what_is_no_archive(content):
    with pytest.raises(ValueError, match=r"."):
        read_npz(content)


def test_refuses_every_cut_and_most_flips(make_schedule):
    """A file that was damaged is refused with a ValueError or is the schedule still; nothing else is raised."""
    content = write_schedule(make_schedule((2, 2)), "npz")
    rng = np.random.default_rng(0)
    for n in rng.integers(0, len(content), 60):
        with pytest.raises(ValueError, match=r"."):
            read_npz(content[:n])
    for n in rng.integers(0, len(content), 300):
        damaged = bytearray(content)
        damaged[n] ^= 1 << int(rng.integers(0, 8))
        try:
            read_npz(bytes(damaged))
        except ValueError:
            continue
