"""HDF5 files: h5py reads them, they come back as the same schedule, and nothing of the clock is in them."""

import io
import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest

from schedules.files import LibraryMissing, read_hdf5, write_schedule
from schedules.rules import INTERPOLATIONS, OUTS_OF_RANGE
from schedules.schedule import SIGN_CONVENTION
from tests.schedules.hostile_schedules import hostile

ROOT = Path(__file__).parents[2]
SHAPES = [((), ()), ((), [()]), ((5,), [(1,)]), ((4, 6), [(0, 0), (2, 3)]), ((1, 6), []), ((2, 3, 4), [(1, 1, 1)])]


@pytest.mark.parametrize(("shape", "failed"), SHAPES)
@pytest.mark.parametrize("kind", ["positive_feedback", "lqr"])
def test_reads_back_the_same_schedule(make_schedule, same_schedule, shape, failed, kind):
    schedule = make_schedule(shape, kind=kind, failed=failed)
    content = write_schedule(schedule, "h5")
    same_schedule(read_hdf5(content), schedule)
    assert write_schedule(read_hdf5(content), "h5") == content


def test_texts_and_extreme_numbers_come_back(make_schedule, same_schedule):
    schedule = hostile(make_schedule((2, 3), failed=[(1, 2)]))
    same_schedule(read_hdf5(write_schedule(schedule, "h5")), schedule)
    schedule = make_schedule((2, 3))
    extreme = np.array([[5e-324, -0.0, 1.7976931348623157e308], [0.1, 1 / 3, -(2.0**-1022)]])
    schedule = replace(schedule, gains=tuple(replace(g, values=extreme) for g in schedule.gains), law="\x00" * 70_000)
    same_schedule(read_hdf5(write_schedule(schedule, "h5")), schedule)


def test_h5py_reads_it(make_schedule):
    schedule = make_schedule((2, 3), failed=[(1, 2)])
    with h5py.File(io.BytesIO(write_schedule(schedule, "h5")), "r") as file:
        assert set(file) == {"altitude_m", "dynamic_pressure_pa", "K_p", "K_d", "K_i", "ok", "outcome", "reason"}
        np.testing.assert_array_equal(file["K_d"][()], schedule.gains[1].values)
        np.testing.assert_array_equal(file["altitude_m"][()], schedule.axes[0].values)
        np.testing.assert_array_equal(file["ok"][()], schedule.outcomes.ok)
        assert file["outcome"][()].tolist() == [[b"ok"] * 3, [b"ok", b"ok", b"infeasible"]]
        assert b"gain margin 4.1 dB" in file["reason"][1, 2]
        assert (file["K_i"].attrs["unit"], file["altitude_m"].attrs["unit"]) == ("1/s", "m")
        for k, axis in enumerate(("altitude_m", "dynamic_pressure_pa")):
            assert file[axis].is_scale
            assert file["K_p"].dims[k].keys() == [axis]
        said = file.attrs
        assert (said["sign_convention"], said["interpolation"]) == (SIGN_CONVENTION, INTERPOLATIONS["multilinear"])
        assert (said["out_of_range"], said["schema_version"]) == (OUTS_OF_RANGE["clip"], 1)
        assert (said["design_id"], said["kind"]) == (schedule.provenance.design_id, "negative_feedback")
        assert said["request_digest"] == schedule.provenance.request_digest
        assert json.loads(said["axes"]) == ["altitude_m", "dynamic_pressure_pa"]
        assert json.loads(said["gains"]) == ["K_p", "K_d", "K_i"]
        assert json.loads(said["proof"]) is None
        assert "reverse order" in said["array_order"]


def test_two_runs_write_the_same_bytes():
    """In processes of their own, more than a second apart: times in a file would be whole seconds."""
    code = (
        "import hashlib, time; import numpy as np; from design.gains import Gain; from design.outcome import Outcomes; "
        "from model.flight import GridAxis; from schedules.files import write_schedule; "
        "from schedules.schedule import GainSchedule, Provenance; "
        "axes = (GridAxis('altitude', 'm', (0.0, 1.0)), GridAxis('mach', '1', (0.1, 0.2, 0.3))); "
        "gains = (Gain('K_p', '1', np.arange(6.0).reshape(2, 3)),); "
        "made = GainSchedule('c', 'negative_feedback', axes, gains, Outcomes.all_ok((2, 3)), 'u', "
        "Provenance('i', 'n', 'd', 'v', 't')); first = write_schedule(made, 'h5'); time.sleep(1.1); "
        "assert write_schedule(made, 'h5') == first; print(hashlib.sha256(first).hexdigest())"
    )
    command = [sys.executable, "-c", code]
    runs = [subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, text=True) for _ in range(2)]
    digests = {run.communicate(timeout=60)[0] for run in runs}
    assert [run.returncode for run in runs] == [0, 0]
    assert len(digests) == 1


def changed(content, change):
    """The file after a change by h5py."""
    data = io.BytesIO(content)
    with h5py.File(data, "r+") as file:
        change(file)
    return data.getvalue()


def instead(name, values):
    def change(file):
        attributes = dict(file[name].attrs) if name in file else {}
        del file[name]
        if values is not None:
            file[name] = values
            file[name].attrs["unit"] = attributes.get("unit", "1")

    return change


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (instead("K_p", None), "it has no K_p"),
        (instead("outcome", None), "it has no outcome"),
        (instead("reason", None), "it has no reason"),
        (instead("K_p", np.zeros((2, 3), dtype=int)), "K_p must hold numbers in double precision"),
        (instead("K_p", np.zeros((3, 2))), "K_p has shape"),
        (instead("K_p", np.ones((2, 3))), "whose outcome is infeasible"),
        (instead("outcome", np.full((2, 3), b"fine")), "not a valid Outcome"),
        (instead("outcome", np.full(6, b"ok")), "outcome has shape"),
        (instead("altitude_m", np.array([2.0, 1.0])), "strictly increasing"),
        (lambda f: f.attrs.__setitem__("format", "x"), "its format is not"),
        (lambda f: f.attrs.__setitem__("schema_version", 9), "schema_version is 9"),
        (lambda f: f.attrs.__setitem__("axes", '"altitude_m"'), "axes must be a list"),
        (lambda f: f.attrs.__setitem__("gains", "[" * 100_000), "not a schedule file"),
        (lambda f: f.attrs.__setitem__("law", "\\"), "not a schedule file"),
        (lambda f: f.attrs.__delitem__("law"), "law must be text"),
        (lambda f: f.attrs.__setitem__("proof", "3"), "proof must be an object"),
        (lambda f: f["K_p"].attrs.__delitem__("unit"), "it has no K_p with a unit"),
        (lambda f: f.create_group("more"), "not a schedule file"),
    ],
)  # fmt: skip
def test_refuses_what_does_not_fit(make_schedule, change, message):
    content = write_schedule(make_schedule((2, 3), failed=[(1, 2)]), "h5")
    with pytest.raises(ValueError, match=message):
        read_hdf5(changed(content, change))


def test_refuses_every_cut(make_schedule):
    content = write_schedule(make_schedule((2, 2)), "h5")
    for n in np.linspace(0, len(content) - 1, 40).astype(int):
        with pytest.raises(ValueError, match="not a schedule file in HDF5"):
            read_hdf5(content[:n])


def test_without_the_library_the_extra_is_named(make_schedule, monkeypatch):
    content = write_schedule(make_schedule((2, 3)), "h5")
    monkeypatch.setitem(sys.modules, "h5py", None)
    with pytest.raises(LibraryMissing, match=r"pip install .\[hdf5\]"):
        write_schedule(make_schedule((2, 3)), "h5")
    with pytest.raises(LibraryMissing, match="hdf5"):
        read_hdf5(content)
    assert write_schedule(make_schedule((2, 3)), "npz")


def test_the_library_is_not_imported_until_it_is_used():
    code = "import sys, schedules.files; assert 'h5py' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=True, timeout=60)
