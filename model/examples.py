"""The shipped sections: two wind-tunnel models and one full-scale aileron, as domain objects.

The wind-tunnel numbers are chosen, not measured: A so that the eigenvalues fall where seed Figs 2.8 to
2.11 show them, B with the geometry of seed Fig 2.3. Both keep the ratio of about twenty between aileron
and tab inertia that seed 2.3 states; the tab's inertia includes its balance weight and drive.
"""

from __future__ import annotations

import numpy as np

from model.aerodynamics import Aerodynamics, Compressibility, Damping
from model.hinge_moments.camber import mean_line
from model.hinge_moments.thin_aerofoil import ThinAerofoil
from model.section import Body, Geometry, Inertia
from model.system import TabAileron
from model.trim import TrimRequest

#: Trim of both wind-tunnel examples: five degrees of incidence, surfaces neutral (seed 4.3).
WIND_TUNNEL_TRIM = TrimRequest(alpha=float(np.deg2rad(5.0)))
#: Trim of the full-scale example.
AIRLINER_TRIM = TrimRequest(alpha=float(np.deg2rad(3.0)))


def wind_tunnel() -> TabAileron:
    """Data set A: small tab, seed Figs 2.8 to 2.11."""
    geometry = Geometry(chord=0.6, span=0.8, aileron_hinge=0.72, tab_hinge=0.96)
    inertia = Inertia(aileron=Body(0.50, 0.010, 4.2e-3), tab=Body(0.05, 0.0009, 2.1e-4))
    return _naca_23012(geometry, inertia)


def wind_tunnel_23012() -> TabAileron:
    """Data set B: geometry of seed Fig 2.3."""
    geometry = Geometry(chord=0.6, span=0.8, aileron_hinge=0.70, tab_hinge=0.88)
    inertia = Inertia(aileron=Body(0.90, 0.010, 7.0e-3), tab=Body(0.08, 0.0005, 3.5e-4))
    return _naca_23012(geometry, inertia)


def airliner_aileron() -> TabAileron:
    """A full-scale outboard aileron of a transport aircraft, with the better physics switched on."""
    geometry = Geometry(chord=3.0, span=2.8, aileron_hinge=0.75, tab_hinge=0.93)
    inertia = Inertia(aileron=Body(30.0, 0.10, 0.95), tab=Body(3.0, 0.01, 0.03))
    return _naca_23012(geometry, inertia, damping="quasi_steady", compressibility="prandtl_glauert")


def _naca_23012(
    geometry: Geometry,
    inertia: Inertia,
    damping: Damping = "thesis",
    compressibility: Compressibility = "none",
) -> TabAileron:
    source = ThinAerofoil(geometry.aileron_hinge, geometry.tab_hinge, mean_line("NACA 23012"))
    return TabAileron(geometry, inertia, Aerodynamics(source, damping=damping, compressibility=compressibility))
