from dataclasses import dataclass

import numpy as np
import pytest

from model.arrays import FloatArray, GridArrays


@dataclass(frozen=True, eq=False)
class Inner(GridArrays):
    a: FloatArray


@dataclass(frozen=True, eq=False)
class Outer(GridArrays):
    inner: Inner
    parts: tuple[Inner, ...]
    b: FloatArray
    label: str = "x"


def test_arrays_become_read_only_and_the_givers_array_stays_writeable():
    given = np.zeros(3)
    result = Inner(given)
    with pytest.raises(ValueError, match="read-only"):
        result.a[0] = 1.0
    given[0] = 2.0


def test_take_reaches_nested_results_and_tuples_of_them():
    a, b = np.arange(6.0).reshape(3, 2), np.arange(3.0)
    outer = Outer(Inner(a), (Inner(a), Inner(a + 1)), b)
    taken = outer.take(np.array([False, True, True]))
    np.testing.assert_array_equal(taken.inner.a, a[1:])
    np.testing.assert_array_equal(taken.parts[1].a, a[1:] + 1)
    np.testing.assert_array_equal(taken.b, [1.0, 2.0])
    assert taken.label == "x"
