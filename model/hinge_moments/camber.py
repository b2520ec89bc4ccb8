"""Mean lines: the symmetric section and NACA's 4-digit and 5-digit camber.

A mean line is kept as its local incidence ``-dz/dx`` written in truncated powers,

    -dz/dx = incidence + sum of w (x - x_i)+ + sum of v (x - x_j)+^2 / 2,

because thin-aerofoil theory has a closed form for each of the three terms.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from model.arrays import FloatArray, Floats

#: What `mean_line` understands, for messages.
ALLOWED_SECTIONS = (
    "'symmetric', a NACA 4-digit section (for example 'NACA 2412') or a NACA 5-digit section with a plain "
    "mean line 210, 220, 230, 240 or 250 (for example 'NACA 23012'); thickness 01 to 40 per cent"
)


@dataclass(frozen=True)
class Bend:
    """One truncated power of the incidence: it begins at `start` (fraction of chord) with `weight`."""

    start: float
    weight: float


@dataclass(frozen=True)
class MeanLine:
    """Camber of a section, by its local incidence in truncated powers (chord 1).

    Attributes
    ----------
    name : the section's name
    incidence : ``-dz/dx`` at the leading edge [rad]
    ramps : terms ``weight (x - start)+``
    parabolas : terms ``weight (x - start)+^2 / 2``
    """

    name: str
    incidence: float = 0.0
    ramps: tuple[Bend, ...] = ()
    parabolas: tuple[Bend, ...] = ()

    def slope(self, x: Floats) -> FloatArray:
        """``dz/dx`` at chord positions x (*X,) [-]."""
        x = np.asarray(x, float)
        incidence = np.full(x.shape, self.incidence)
        for bend in self.ramps:
            incidence = incidence + bend.weight * np.maximum(x - bend.start, 0.0)
        for bend in self.parabolas:
            incidence = incidence + bend.weight / 2.0 * np.maximum(x - bend.start, 0.0) ** 2
        return np.asarray(-incidence)

    def ordinate(self, x: Floats) -> FloatArray:
        """``z`` above the chord line at chord positions x (*X,), in chords."""
        x = np.asarray(x, float)
        drop = self.incidence * x
        for bend in self.ramps:
            drop = drop + bend.weight / 2.0 * np.maximum(x - bend.start, 0.0) ** 2
        for bend in self.parabolas:
            drop = drop + bend.weight / 6.0 * np.maximum(x - bend.start, 0.0) ** 3
        return np.asarray(-drop)


SYMMETRIC = MeanLine("symmetric")

# NACA report 537: position of maximum camber digit -> (m, k1) of the plain mean line, design cl 0.3.
_FIVE_DIGIT = {
    "1": (0.0580, 361.4),
    "2": (0.1260, 51.64),
    "3": (0.2025, 15.957),
    "4": (0.2900, 6.643),
    "5": (0.3910, 3.230),
}


def mean_line(section: str) -> MeanLine:
    """Mean line of a section by name.

    Parameters
    ----------
    section : ``symmetric``, ``NACA 2412`` (also ``naca2412``, ``2412``), ``NACA 23012``, ...

    Raises
    ------
    ValueError : any other name; the message says what is allowed
    """
    text = section.strip()
    if text.lower() == "symmetric":
        return SYMMETRIC
    match = re.fullmatch(r"(?:NACA[ _-]?)?([0-9]{4,5})", text, flags=re.IGNORECASE)
    if match is None or not 1 <= int(match[1][-2:]) <= 40:
        raise ValueError(f"unknown section {section!r}: expected {ALLOWED_SECTIONS}")
    digits = match[1]
    line = _four_digit(digits) if len(digits) == 4 else _five_digit(digits)
    if line is None:
        raise ValueError(f"section {section!r} has no mean line here: expected {ALLOWED_SECTIONS}")
    return line


def _four_digit(digits: str) -> MeanLine | None:
    """Two parabolas of camber m at position p: ``dz/dx = 2m/p^2 (p - x)``, then ``2m/(1-p)^2 (p - x)``."""
    m, p = int(digits[0]) / 100.0, int(digits[1]) / 10.0
    if m == 0.0 and p == 0.0:
        return MeanLine(f"NACA {digits}")
    if m == 0.0 or p == 0.0:
        return None
    front, rear = 2.0 * m / p**2, 2.0 * m / (1.0 - p) ** 2
    return MeanLine(f"NACA {digits}", -2.0 * m / p, (Bend(0.0, front), Bend(p, rear - front)))


def _five_digit(digits: str) -> MeanLine | None:
    """Cubic ``z = k1/6 (x^3 - 3 m x^2 + m^2 (3 - m) x)`` to x = m, straight behind it (NACA report 537).

    The first digit is design cl / 0.15; the tabulated k1 is for 0.3 and scales with it.
    """
    if digits[0] == "0" or digits[1] not in _FIVE_DIGIT or digits[2] != "0":
        return None
    m, k1 = _FIVE_DIGIT[digits[1]]
    k1 *= int(digits[0]) / 2.0
    return MeanLine(
        f"NACA {digits}",
        -k1 / 6.0 * m * m * (3.0 - m),
        (Bend(0.0, k1 * m),),
        (Bend(0.0, -k1), Bend(m, k1)),
    )
