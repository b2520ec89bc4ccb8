import numpy as np
import pytest

from model.hinge_moments import read_table as read_table_module
from model.hinge_moments.read_table import read_table
from model.hinge_moments.xfoil_naca23012 import xfoil_naca23012

PLAIN = """# a comment, with commas
alpha_deg,da_deg,dt_deg,C_Ha,C_Ht
# another
0,10,-5,0.01,0.001

5,10,-5,0.02,0.002
"""


def test_plain_table():
    table = read_table(PLAIN)
    np.testing.assert_array_equal(table.angles, np.deg2rad([[0, -5, 10], [5, -5, 10]]))
    np.testing.assert_array_equal(table.coefficients, [[0.001, 0.01], [0.002, 0.02]])


@pytest.mark.parametrize(
    "change", [("\n", "\r\n"), ("# a comment", "\ufeff# a comment"), (",", " , "), ("5,10", '"5",10')]
)
def test_how_programs_write_csv(change):
    table = read_table(PLAIN.replace(*change))
    np.testing.assert_array_equal(table.coefficients, read_table(PLAIN).coefficients)
    np.testing.assert_array_equal(table.angles, read_table(PLAIN).angles)


def test_columns_in_any_order_with_others_between():
    text = "C_Ht,note,dt_up_rel_deg,C_Ha,da_up_deg,alpha_deg\n0.001,x,-5,0.01,10,0\n"
    table = read_table(text)
    np.testing.assert_array_equal(table.angles, np.deg2rad([[0, -5, 10]]))
    np.testing.assert_array_equal(table.coefficients, [[0.001, 0.01]])


def test_missing_coefficients_are_gaps():
    table = read_table(PLAIN + "7,10,-5,,0.1\n8,10,-5,0.1,nan\n9,10,-5, ,\n")
    assert (len(table.angles), table.count.given, table.count.without_coefficients) == (2, 5, 3)


def test_rows_are_chosen_by_other_columns():
    text = "case,Re,alpha_deg,da_deg,dt_deg,C_Ha,C_Ht\n" + "".join(
        f"{case},{re},0,{da},0,{value},0\n"
        for value, (case, re, da) in enumerate([("trip", "1e+06", 1), ("trip", "3000000", 1), ("free", "1e6", 1)])
    )
    assert read_table(text, {"case": "trip", "Re": 1e6}).coefficients[0, 1] == 0.0
    assert read_table(text, {"case": "trip", "Re": "3e6"}).coefficients[0, 1] == 1.0
    assert read_table(text, {"case": "free"}).coefficients[0, 1] == 2.0
    whole = read_table(text)
    assert (whole.count.merged, whole.count.C_Ha_disagreement) == (2, 1.0)
    with pytest.raises(ValueError, match=r"no rows with case = trip, Re = 2e6"):
        read_table(text, {"case": "trip", "Re": "2e6"})
    with pytest.raises(ValueError, match=r"chosen by column 'Mach', which the table has 0 times"):
        read_table(text, {"Mach": 0.1})


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "",
            "lacks columns: alpha_deg, da_deg or da_up_deg or aileron_deg, dt_deg or dt_up_rel_deg or tab_deg, "
            "C_Ha, C_Ht",
        ),
        ("# only comments\n", "lacks columns"),
        ("alpha_deg,da_deg,dt_deg,C_Ha\n0,0,0,1\n", "lacks columns: C_Ht; its header is 'alpha_deg,da_deg"),
        (PLAIN.replace(",", ";"), "lacks columns"),
        (PLAIN.replace("dt_deg", "dt_deg,dt_deg"), "2 columns for dt_deg or dt_up_rel_deg"),
        (PLAIN.replace("dt_deg", "da_up_deg"), "2 columns for da_deg or da_up_deg"),
        ("alpha_deg,da_deg,dt_deg,C_Ha,C_Ht\n", "the table has no rows"),
        (PLAIN + "ten,10,-5,0.1,0.1\n", "line 7, column alpha_deg: 'ten' is not a number"),
        (PLAIN + "1,10,-5,0.1,0.1.2\n", "line 7, column C_Ht: '0.1.2' is not a number"),
        (PLAIN + "1,,-5,0.1,0.1\n", "line 7, column da_deg: '' is not a number"),
        (PLAIN + "1,nan,-5,0.1,0.1\n", "line 7, column da_deg: nan must lie within"),
        (PLAIN + "1,91,-5,0.1,0.1\n", r"line 7, column da_deg: 91 must lie within \+/-90 degrees"),
        (PLAIN + "1,1,-5,1e999,0.1\n", "line 7, column C_Ha: 1e999 is infinite"),
        (PLAIN + "1,1,-5,0.1\n", "line 7 has 4 columns; the header has 5"),
        (PLAIN + "1,1,-5,0.1,0.1,0.1\n", "line 7 has 6 columns; the header has 5"),
        (PLAIN + "1,1,-5," + "1" * 200_000 + ",0.1\n", "line 7: the text is no CSV"),
        ("\x00\x01\xff", "lacks columns"),
    ],
)
def test_unreadable_tables_are_refused_by_line_and_column(text, message):
    with pytest.raises(ValueError, match=message):
        read_table(text)


def test_more_rows_than_allowed_stop_the_reading(monkeypatch):
    monkeypatch.setattr(read_table_module, "MAX_ROWS", 2)
    assert len(read_table(PLAIN).angles) == 2
    with pytest.raises(ValueError, match="more than 2 rows"):
        read_table(PLAIN + "7,10,-5,0.1,0.1\nnot,even,read,any,more\n")


@pytest.mark.parametrize("reynolds", [1_000_000, 3_000_000])
def test_worked_example(reynolds):
    table = xfoil_naca23012(reynolds)
    assert len(table.angles) == 242
    assert (table.count.given, table.count.merged, table.count.without_coefficients) == (242, 0, 0)


def test_worked_example_has_two_reynolds_numbers():
    with pytest.raises(ValueError, match=r"no rows with case = trip, Re = 2000000"):
        xfoil_naca23012(2_000_000)
