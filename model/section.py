"""The section: wing chord, two hinges, two bodies, and the inertia matrix they make."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from model.arrays import FloatArray, Floats


@dataclass(frozen=True)
class Geometry:
    """Aerofoil section with an aileron and, hinged on the aileron, a trailing-edge tab.

    Attributes
    ----------
    chord : wing chord c [m]
    span : span s of aileron and tab [m]
    aileron_hinge, tab_hinge : hinge positions x_a < x_t as fractions of the wing chord, in (0, 1)
    """

    chord: Floats
    span: Floats
    aileron_hinge: Floats
    tab_hinge: Floats

    def __post_init__(self) -> None:
        sizes = np.broadcast_arrays(self.chord, self.span)
        if not np.all(np.isfinite(sizes) & (np.asarray(sizes) > 0)):
            raise ValueError("chord and span must be positive and finite [m]")
        if not np.all((np.asarray(self.aileron_hinge) > 0) & (np.asarray(self.tab_hinge) < 1)):
            raise ValueError("hinges must lie inside the chord: 0 < aileron_hinge, tab_hinge < 1")
        if not np.all(np.asarray(self.aileron_hinge) < np.asarray(self.tab_hinge)):
            raise ValueError("the tab hinge must lie behind the aileron hinge")

    @property
    def aileron_chord(self) -> Floats:
        """Aileron hinge to trailing edge, ca [m]."""
        return (1.0 - self.aileron_hinge) * self.chord

    @property
    def tab_chord(self) -> Floats:
        """Tab hinge to trailing edge, ct [m]."""
        return (1.0 - self.tab_hinge) * self.chord

    @property
    def hinge_distance(self) -> Floats:
        """Aileron hinge to tab hinge, l [m]."""
        return (self.tab_hinge - self.aileron_hinge) * self.chord


@dataclass(frozen=True)
class Body:
    """A rigid surface. cg_offset is aft of its own hinge; inertia is about its own centre of mass.

    Attributes
    ----------
    mass : [kg]
    cg_offset : centre of mass aft of the body's own hinge [m]; negative when mass-balanced ahead of it
    inertia : about its own centre of mass [kg m^2]
    """

    mass: Floats
    cg_offset: Floats
    inertia: Floats

    def __post_init__(self) -> None:
        amounts = np.broadcast_arrays(self.mass, self.inertia)
        if not np.all(np.isfinite(amounts) & (np.asarray(amounts) > 0)):
            raise ValueError("mass [kg] and inertia [kg m^2] must be positive and finite")
        if not np.all(np.isfinite(self.cg_offset)):
            raise ValueError("cg_offset must be finite [m]")


@dataclass(frozen=True)
class Inertia:
    """The two bodies of the section: the aileron without its tab, and the tab."""

    aileron: Body
    tab: Body


def inertia_matrix(geometry: Geometry, inertia: Inertia) -> FloatArray:
    """Coupled inertia matrix J, order [tab, aileron] (seed 2.1.8; lever corrected: README, decision 3).

    The tab angle is relative to the aileron, and ``e_at`` is the distance from the aileron hinge to
    the centre of mass of the tab, so J is symmetric and positive definite for any real bodies.

    Returns
    -------
    (..., 2, 2) array [kg m^2], leading axes those the inputs broadcast to
    """
    a, t = inertia.aileron, inertia.tab
    lever = geometry.hinge_distance + t.cg_offset
    tt = t.inertia + t.mass * t.cg_offset**2
    ta = t.inertia + t.mass * t.cg_offset * lever
    aa = a.inertia + t.inertia + a.mass * a.cg_offset**2 + t.mass * lever**2
    tt, ta, aa = np.broadcast_arrays(*(np.asarray(x, dtype=float) for x in (tt, ta, aa)))
    return np.stack([np.stack([tt, ta], axis=-1), np.stack([ta, aa], axis=-1)], axis=-2)
