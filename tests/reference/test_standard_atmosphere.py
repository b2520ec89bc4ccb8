"""ISO 2533:1975, tables 5 and 6, in terms of geopotential altitude.

Columns: altitude [m], temperature [K], pressure [mbar], density [kg/m^3], speed of sound [m/s], dynamic
viscosity [Pa s]. ICAO Doc 7488 defines the same atmosphere with the same constants.
"""

from decimal import Decimal

import numpy as np
import pytest

from model.atmosphere import standard_atmosphere

TABLE = """
-2000 301.150 1.27774e+3 1.47808e+0 347.886 1.8514e-5
-1000 294.650 1.13929e+3 1.34700e+0 344.111 1.8206e-5
0     288.150 1.01325e+3 1.22500e+0 340.294 1.7894e-5
1000  281.650 8.98746e+2 1.11164e+0 336.434 1.7578e-5
2000  275.150 7.94952e+2 1.00649e+0 332.529 1.7260e-5
3000  268.650 7.01085e+2 9.09122e-1 328.578 1.6937e-5
4000  262.150 6.16402e+2 8.19129e-1 324.579 1.6611e-5
5000  255.650 5.40199e+2 7.36116e-1 320.529 1.6281e-5
6000  249.150 4.71810e+2 6.59697e-1 316.428 1.5947e-5
8000  236.150 3.55998e+2 5.25167e-1 308.063 1.5268e-5
9000  229.650 3.07424e+2 4.66348e-1 303.793 1.4922e-5
10000 223.150 2.64362e+2 4.12706e-1 299.463 1.4571e-5
11000 216.650 2.26320e+2 3.63918e-1 295.069 1.4216e-5
12000 216.650 1.93303e+2 3.10827e-1 295.069 1.4216e-5
15000 216.650 1.20445e+2 1.93673e-1 295.069 1.4216e-5
18000 216.650 7.50482e+1 1.20676e-1 295.069 1.4216e-5
20000 216.650 5.47487e+1 8.80345e-2 295.069 1.4216e-5
22000 218.650 3.99977e+1 6.37271e-2 296.428 1.4326e-5
25000 221.650 2.51101e+1 3.94656e-2 298.455 1.4490e-5
28000 224.650 1.58628e+1 2.45987e-2 300.468 1.4652e-5
32000 228.650 8.68014e+0 1.32249e-2 303.131 1.4868e-5
"""
ROWS = [line.split() for line in TABLE.split("\n") if line]


def half_a_unit(printed: str) -> float:
    """Half a unit of the last digit printed."""
    return 0.5 * float(Decimal(1).scaleb(int(Decimal(printed).as_tuple().exponent)))


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row[0])
def test_printed_tables(row):
    altitude, temperature, pressure, density, sound, viscosity = row
    air = standard_atmosphere(float(altitude))
    # Above 11 km the printed pressures start from a base rounded to 226.320 mbar, two parts in a million
    # low, and cannot be met to their sixth digit by the defining equations: the fifth is compared there.
    coarse = 10.0 if float(altitude) > 11000.0 else 1.0
    for value, printed, slack in (
        (air.temperature, temperature, 1.0),
        (air.pressure / 100.0, pressure, coarse),
        (air.density, density, coarse),
        (air.speed_of_sound, sound, 1.0),
        (air.dynamic_viscosity, viscosity, 1.0),
    ):
        assert abs(float(value) - float(printed)) <= slack * half_a_unit(printed)


def test_base_pressures_of_the_us_standard_atmosphere_1976():
    # 22632.06, 5474.889 and 868.0187 Pa with its own gas constant of 287.05307 J/(kg K): five digits agree.
    pressure = standard_atmosphere(np.array([11000.0, 20000.0, 32000.0])).pressure
    assert np.all(np.abs(pressure - [22632.0, 5474.9, 868.02]) <= [0.5, 0.05, 0.005])
