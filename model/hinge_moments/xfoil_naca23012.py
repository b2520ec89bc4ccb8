"""The worked example of a table: a NACA 23012 with hinges at 0.70 and 0.88 of the chord, by Xfoil 6.99.

Transition is forced at a tenth of the chord, Mach 0; incidence 0 and 5 degrees, both surfaces from -20 to 20.
The file beside this one says how it was computed.
"""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from model.hinge_moments.read_table import read_table
from model.hinge_moments.table import HingeMomentTable

AILERON_HINGE, TAB_HINGE = 0.70, 0.88

_FILE = Path(__file__).with_name("xfoil_naca23012_trip.csv")


def xfoil_naca23012(reynolds: Literal[1_000_000, 3_000_000] = 3_000_000) -> HingeMomentTable:
    """Table of 2 incidences by 11 tab by 11 aileron angles, at a Reynolds number of one or three million.

    Raises
    ------
    ValueError : another Reynolds number
    """
    return read_table(_FILE.read_text(encoding="ascii"), {"case": "trip", "Re": reynolds})
