"""The physical system: geometry, inertia and aerodynamics of one tab-aileron section."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from model.aerodynamics import Aerodynamics
from model.arrays import FloatArray
from model.flight import FlightCondition
from model.hinge_moments.closed_forms import (
    acceleration_moment,
    between_surfaces,
    incidence_moment,
    rate_moment,
)
from model.hinge_moments.thin_aerofoil import ThinAerofoil
from model.hinge_moments.unsteady import circulatory_angle, circulatory_rate
from model.section import Geometry, Inertia, inertia_matrix


@dataclass(frozen=True)
class TabAileron:
    """One section with its bodies and its air.

    Raises
    ------
    ValueError : a thin-aerofoil source whose hinges are not the geometry's
    """

    geometry: Geometry
    inertia: Inertia
    aerodynamics: Aerodynamics

    def __post_init__(self) -> None:
        source, geometry = self.aerodynamics.source, self.geometry
        if isinstance(source, ThinAerofoil) and not (
            np.array_equal(source.aileron_hinge, geometry.aileron_hinge)
            and np.array_equal(source.tab_hinge, geometry.tab_hinge)
        ):
            raise ValueError("the thin-aerofoil source must have the hinges of the geometry")

    @cached_property
    def inertia_matrix(self) -> FloatArray:
        """J of the bodies alone (*H, 2, 2), order [tab, aileron] [kg m^2] (seed 2.1.8)."""
        return inertia_matrix(self.geometry, self.inertia)

    @cached_property
    def rate_derivatives(self) -> FloatArray:
        """Quasi-steady ``dC_H / d(c d'/V)`` (*H, 2, 2), order [tab, aileron] [-]."""
        return between_surfaces(rate_moment, self.geometry.aileron_hinge, self.geometry.tab_hinge)

    @cached_property
    def acceleration_derivatives(self) -> FloatArray:
        """Virtual inertia ``dC_H / d(c^2 d''/V^2)`` (*H, 2, 2), symmetric, order [tab, aileron] [-]."""
        return between_surfaces(acceleration_moment, self.geometry.aileron_hinge, self.geometry.tab_hinge)

    @cached_property
    def incidence_derivatives(self) -> FloatArray:
        """Load moment at each hinge per radian of incidence, ``G_alpha`` (*H, 2), order [tab, aileron] [1/rad]."""
        return incidence_moment(self._hinges)

    @cached_property
    def circulatory_angles(self) -> FloatArray:
        """Incidence that a radian of each surface is worth to the circulation (*H, 2), order [tab, aileron] [-]."""
        return circulatory_angle(self._hinges)

    @cached_property
    def circulatory_rates(self) -> FloatArray:
        """The same of a unit of ``c d'/V`` (*H, 2), order [tab, aileron] [-]."""
        return circulatory_rate(self._hinges)

    @property
    def _hinges(self) -> FloatArray:
        hinges = (np.asarray(x, float) for x in (self.geometry.tab_hinge, self.geometry.aileron_hinge))
        return np.stack(np.broadcast_arrays(*hinges), axis=-1)

    def hinge_load(self, condition: FlightCondition) -> FloatArray:
        """Torque of a unit hinge-moment coefficient, ``q c^2 s`` (*G,) [N m]; seed 2.2.4 times the span."""
        geometry = self.geometry
        return np.asarray(condition.dynamic_pressure * (geometry.chord**2 * geometry.span))

    def moving_inertia(self, condition: FlightCondition) -> FloatArray:
        """J of the bodies, and of the air where asked for (*G, 2, 2) [kg m^2].

        The air adds ``rho c^4 s / 2`` times the acceleration derivatives, whatever the airspeed.
        """
        if not self.aerodynamics.virtual_inertia:
            return self.inertia_matrix
        chord, span = self.geometry.chord, self.geometry.span
        air = np.asarray(0.5 * condition.air.density * chord**4 * span)
        return np.asarray(self.inertia_matrix + air[..., None, None] * self.acceleration_derivatives)
