import io

import numpy as np
import pytest
from scipy.io import loadmat, savemat

from schedules.files import read_matlab, write_schedule

SHAPES = [
    ((), ()),
    ((), [()]),
    ((5,), [(1,)]),
    ((1,), []),
    ((4, 6), [(0, 0), (2, 3)]),
    ((1, 6), [(0, 2)]),
    ((4, 1), []),
    ((1, 1), [(0, 0)]),
    ((2, 3, 4), [(1, 1, 1)]),
    ((2, 3, 1), []),
]


@pytest.mark.parametrize(("shape", "failed"), SHAPES)
@pytest.mark.parametrize("kind", ["positive_feedback", "lqr"])
def test_reads_back_the_same_schedule(make_schedule, same_schedule, shape, failed, kind):
    """Texts that are not ASCII come back as the file has them; all else is the same, gains to the last bit."""
    schedule = make_schedule(shape, kind=kind, failed=failed)
    name = schedule.provenance.design_name.encode("ascii", "backslashreplace").decode()
    provenance = type(schedule.provenance)(**{**vars(schedule.provenance), "design_name": name, "version": ""})
    schedule = type(schedule)(**{**vars(schedule), "provenance": provenance})
    content = write_schedule(schedule, "mat")
    same_schedule(read_matlab(content), schedule)
    assert write_schedule(read_matlab(content), "mat") == content


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda v: v.pop("gainfield"), "no struct gainfield"),
        (lambda v: v["gainfield"].update(format="x"), "its format is not"),
        (lambda v: v["gainfield"].update(schema_version=9.0), "schema_version is 9.0"),
        (lambda v: v["gainfield"].update(units=1.0), "units must be a struct"),
        (lambda v: v["gainfield"].pop("axes"), "altitude_m has 2 numbers, the grid 1"),
        (lambda v: v.pop("K_d"), "it has no K_d"),
        (lambda v: v.update(K_d="text"), "K_d must hold numbers"),
        (lambda v: v.update(K_d=np.zeros((2, 2))), "K_d has 4 numbers, the grid 6"),
        (lambda v: v.update(K_d=np.zeros((2, 3))), "whose outcome is infeasible"),
        (lambda v: v["gainfield"].update(outcomes=np.array(["ok"], dtype=object)), "outcomes must be 6 cells"),
        (lambda v: v["gainfield"].update(kind=3.0), "kind must be text"),
    ],
)
def test_refuses_what_does_not_fit(make_schedule, change, message):
    content = write_schedule(make_schedule((2, 3), failed=[(1, 2)]), "mat")
    variables = loadmat(io.BytesIO(content), simplify_cells=True)
    variables = {name: value for name, value in variables.items() if not name.startswith("__")}
    change(variables)
    spoilt = io.BytesIO()
    savemat(spoilt, variables, long_field_names=True)
    with pytest.raises(ValueError, match=message):
        read_matlab(spoilt.getvalue())


@pytest.mark.parametrize(
    "content", [b"", b"x" * 50, b"x" * 500, b"MATLAB 5.0".ljust(124) + b"\x00\x01IM" + b"\xff" * 64]
)
def test_refuses_what_is_no_mat_file(content):
    with pytest.raises(ValueError, match=r"."):
        read_matlab(content)


def test_refuses_a_damaged_file_with_the_same_error(make_schedule):
    """Cut short or with a bit changed, a file is refused with a ValueError or read: nothing else is raised."""
    content = write_schedule(make_schedule((2, 2)), "mat")
    rng = np.random.default_rng(0)
    damaged = [content[:n] for n in rng.integers(0, len(content), 60)]
    for n in rng.integers(0, len(content), 400):
        flipped = bytearray(content)
        flipped[n] ^= 1 << int(rng.integers(0, 8))
        damaged.append(bytes(flipped))
    refused = 0
    for one in damaged:
        try:
            read_matlab(one)
        except ValueError:
            refused += 1
    assert refused > 300
