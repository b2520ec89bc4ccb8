import numpy as np
import pytest

from model.hinge_moments import table as table_module
from model.hinge_moments.levels import level_index
from model.hinge_moments.table import MAX_ROWS, table_of_rows

ROWS = {
    "alpha": [0.1, 0.0, 0.0, 0.1],
    "da": [0.2, 0.2, -0.2, -0.2],
    "dt": [0.0, 0.1, 0.0, 0.1],
    "C_Ha": [4.0, 2.0, 1.0, 3.0],
    "C_Ht": [0.4, 0.2, 0.1, 0.3],
}


def test_rows_are_sorted_and_kept_together():
    table = table_of_rows(**ROWS)
    np.testing.assert_array_equal(table.angles, [[0, 0, -0.2], [0, 0.1, 0.2], [0.1, 0, 0.2], [0.1, 0.1, -0.2]])
    np.testing.assert_array_equal(table.coefficients, [[0.1, 1], [0.2, 2], [0.4, 4], [0.3, 3]])
    assert (table.count.given, table.count.merged, table.count.without_coefficients) == (4, 0, 0)
    with pytest.raises(ValueError, match="read-only"):
        table.angles[0, 0] = 1.0


def test_repeated_rows_are_averaged_and_their_disagreement_told():
    table = table_of_rows(
        alpha=[0.0] * 5, da=[0.1, 0.1, 0.2, 0.1 + 1e-12, 0.2], dt=[0.0] * 5,
        C_Ha=[1.0, 2.0, 7.0, 6.0, 7.0], C_Ht=[0.1, 0.1, 0.2, 0.1, 0.4],
    )  # fmt: skip
    np.testing.assert_allclose(table.coefficients, [[0.1, 3.0], [0.3, 7.0]], rtol=1e-15)
    assert (table.count.given, table.count.merged) == (5, 3)
    assert table.count.C_Ha_disagreement == 3.0
    assert table.count.C_Ht_disagreement == pytest.approx(0.1)


def test_rows_without_a_coefficient_are_dropped_and_counted():
    table = table_of_rows(**(ROWS | {"C_Ha": [4.0, np.nan, 1.0, 3.0], "C_Ht": [np.nan, np.nan, 0.1, 0.3]}))
    assert len(table.angles) == 2
    assert (table.count.given, table.count.without_coefficients) == (4, 2)


def test_a_gap_filled_by_another_row_is_no_gap_in_the_table():
    table = table_of_rows(alpha=[0, 0], da=[0.1, 0.1], dt=[0, 0], C_Ha=[np.nan, 1.0], C_Ht=[0.1, 0.2])
    np.testing.assert_array_equal(table.coefficients, [[0.2, 1.0]])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"C_Ha": [np.nan] * 4}, "no row of the table has both"),
        ({key: [] for key in ROWS}, "no row of the table has both"),
        ({"da": [0.2, 0.2, -0.2]}, "lists of one length"),
        (dict.fromkeys(ROWS, 0.1), "lists of one length"),
        ({"da": [0.2, 0.2, np.nan, 0.1]}, r"row 3: da is nan rad"),
        ({"dt": [0.2, -10.0, 0.3, 0.1]}, r"row 2: dt is -10 rad; it must lie within"),
        ({"alpha": [0.2, 0.1, 0.3, np.inf]}, r"row 4: alpha is inf rad"),
        ({"C_Ht": [0.2, -np.inf, 0.3, 0.1]}, r"row 2: C_Ht is infinite"),
    ],
)
def test_impossible_rows_are_refused(change, message):
    with pytest.raises(ValueError, match=message):
        table_of_rows(**(ROWS | change))


def test_more_rows_than_allowed_are_refused(monkeypatch):
    assert MAX_ROWS == 1_000_000
    monkeypatch.setattr(table_module, "MAX_ROWS", 3)
    with pytest.raises(ValueError, match="the table has 4 rows; at most 3 are allowed"):
        table_of_rows(**ROWS)


def test_levels_join_what_rounding_parted():
    values = np.array([0.3, 0.1, 0.3 + 1e-15, -0.2, 0.1 - 1e-12])
    levels, index = level_index(values)
    np.testing.assert_allclose(levels, [-0.2, 0.1, 0.3], rtol=1e-10)
    np.testing.assert_array_equal(index, [2, 1, 2, 0, 1])
