"""Lift and pitching moment of thin aerofoils: what identifies a mean line and a flap in the literature.

From Glauert's coefficients of an incidence ``e(theta)``: ``A_0`` its mean over theta, ``A_n`` minus twice
its cosine means; ``c_l = pi (2 A_0 + A_1)`` and ``c_m,c/4 = -pi/4 (A_1 - A_2)``, nose up positive.
"""

from __future__ import annotations

import numpy as np

from model.arrays import FloatArray, Floats
from model.hinge_moments.angles import cosine, rest, sine
from model.hinge_moments.camber import MeanLine


def flap_lift(flap: Floats) -> FloatArray:
    """Lift coefficient per radian of a flap hinged at `flap`, trailing edge down (*X,) [1/rad]; ``2 T10``."""
    return np.asarray(2.0 * (rest(flap) + sine(flap)))


def flap_pitching_moment(flap: Floats) -> FloatArray:
    """Pitching moment about the quarter chord per radian of a flap, trailing edge down (*X,) [1/rad]."""
    return np.asarray(-0.5 * sine(flap) * (1.0 - cosine(flap)))


def camber_coefficients(line: MeanLine) -> FloatArray:
    """Glauert's ``[A_0, A_1, A_2]`` of a mean line at zero incidence, (3,)."""
    total = np.array([line.incidence, 0.0, 0.0])
    for bend in line.ramps:
        w, s, b = rest(bend.start), sine(bend.start), cosine(bend.start)
        ramp = [(w * b + s) / 2.0, (w + s * b) / 2.0, -(s**3) / 3.0]
        total = total + bend.weight / np.pi * np.array(ramp)
    for bend in line.parabolas:
        w, s, b = rest(bend.start), sine(bend.start), cosine(bend.start)
        parabola = [
            (w * (b * b + 0.5) + 1.5 * s * b) / 8.0,
            (b * w + s - s**3 / 3.0) / 4.0,
            -(w / 4.0 + s * b / 4.0 + s**3 * b / 6.0) / 4.0,
        ]
        total = total + bend.weight / np.pi * np.array(parabola)
    return np.asarray(total)


def zero_lift_angle(line: MeanLine) -> float:
    """Incidence at which the mean line carries no lift [rad]."""
    a0, a1, _ = camber_coefficients(line)
    return float(-(a0 + 0.5 * a1))


def quarter_chord_moment(line: MeanLine) -> float:
    """Pitching-moment coefficient about the quarter chord, at any incidence [-]."""
    _, a1, a2 = camber_coefficients(line)
    return float(-np.pi / 4.0 * (a1 - a2))


def ideal_incidence(line: MeanLine) -> float:
    """Incidence at which the flow enters the leading edge smoothly, without a suction peak [rad]."""
    return float(-camber_coefficients(line)[0])


def ideal_lift(line: MeanLine) -> float:
    """Lift coefficient at the ideal incidence [-]."""
    return float(np.pi * camber_coefficients(line)[1])
