"""Why the section is unstable: undamped flutter of a stiffness that is not symmetric, damping, or divergence.

Without damping ``J d'' + K d = 0`` with ``K = -Kk``, order [tab, aileron]. Its solutions ``exp(i w t)`` have

    det(J) w^4 - b w^2 + det(K) = 0,    b = J_tt K_aa + J_aa K_tt - J_ta (K_ta + K_at)

and, with ``r = J_aa/J_tt`` and ``k = J_ta/J_tt``, the squares of both frequencies are complex when

    (r K_tt + K_aa - k (K_ta + K_at))^2 < 4 (r - k^2) det(K).

A symmetric K (springs, or any conservative load) never does that. The air's K is not symmetric: the tab's
deflection changes the circulation and with it the whole load on the aileron, the aileron's hardly reaches the
tab. K goes with the dynamic pressure as a whole, so the criterion knows no flutter speed.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from model.arrays import ComplexArray, FloatArray, GridArrays, ObjectArray

#: Growth rates below this part of the largest eigenvalue are neutral: rounding would decide their sign.
NEUTRAL = 1e-9


class Mechanism(StrEnum):
    """Stability of a linear model, and what decides it."""

    STABLE = "stable"
    NEUTRAL = "neutral"
    #: Grows, and would do so without any damping: the stiffness is not symmetric.
    UNDAMPED_FLUTTER = "undamped_flutter"
    #: Grows, and would neither grow nor decay without damping: the damping, or the lag of the air, feeds it.
    DAMPING_DRIVEN = "damping_driven"
    #: Grows without oscillating when undamped: the stiffness does not restore.
    DIVERGENCE = "divergence"


@dataclass(frozen=True, eq=False)
class FlutterCriterion(GridArrays):
    """The criterion for undamped flutter, each (*G,).

    The stiffness is divided by its Frobenius norm, so that `left` and `right` do not depend on the dynamic pressure.

    Attributes
    ----------
    inertia_ratio : ``r = J_aa / J_tt`` [-]
    inertia_coupling : ``k = J_ta / J_tt`` [-]
    left : ``(r K_tt + K_aa - k (K_ta + K_at))^2`` [-]
    right : ``4 (r - k^2) det K`` [-]
    undamped : object, `Mechanism` of the model without damping: neutral, undamped flutter or divergence
    """

    inertia_ratio: FloatArray
    inertia_coupling: FloatArray
    left: FloatArray
    right: FloatArray
    undamped: ObjectArray

    @property
    def discriminant(self) -> FloatArray:
        """``left - right`` (*G,) [-]: negative where the undamped model flutters."""
        return np.asarray(self.left - self.right)


@dataclass(frozen=True, eq=False)
class FlutterRange(GridArrays):
    """Inertia ratios ``r = J_aa/J_tt`` between which the undamped model flutters (*G,); nan where it never does."""

    lower: FloatArray
    upper: FloatArray


def flutter_criterion(inertia: FloatArray, stiffness: FloatArray) -> FlutterCriterion:
    """Criterion from ``J`` (*G, 2, 2) and ``Kk`` (*G, 2, 2) of ``J d'' = Bk d' + Kk d + T``, order [tab, aileron]."""
    norm = np.sqrt(np.sum(stiffness**2, axis=(-2, -1)))
    K = -stiffness / np.where(norm > 0.0, norm, 1.0)[..., None, None]
    r, k = inertia[..., 1, 1] / inertia[..., 0, 0], inertia[..., 0, 1] / inertia[..., 0, 0]
    determinant = _determinant(K)
    middle = r * K[..., 0, 0] + K[..., 1, 1] - k * (K[..., 0, 1] + K[..., 1, 0])
    left, right = middle**2, 4.0 * (r - k**2) * determinant
    restoring = (middle >= 0.0) & (determinant >= 0.0)
    undamped = np.where(restoring, _word(Mechanism.NEUTRAL), _word(Mechanism.DIVERGENCE))
    undamped = np.where(left < right, _word(Mechanism.UNDAMPED_FLUTTER), undamped)
    return FlutterCriterion(r, k, np.asarray(left), np.asarray(right), undamped)


def flutter_range(stiffness: FloatArray, coupling: FloatArray | float) -> FlutterRange:
    """Range of inertia ratios with undamped flutter, in closed form.

    The criterion is quadratic in r; it has solutions where ``(K_ta - k K_tt)(K_at - k K_tt) det K < 0``, so flutter
    needs ``k K_tt`` between the two cross stiffnesses.

    Parameters
    ----------
    stiffness : restoring K (*G, 2, 2), order [tab, aileron], in any unit: ``C_H`` derivatives will do
    coupling : ``k = J_ta / J_tt`` (*G,), one for a tab balanced about its hinge
    """
    tt, ta, at = stiffness[..., 0, 0], stiffness[..., 0, 1], stiffness[..., 1, 0]
    determinant = _determinant(stiffness)
    possible = -determinant * (ta - coupling * tt) * (at - coupling * tt)
    root = 2.0 * np.sqrt(np.where(possible > 0.0, possible, np.nan))
    middle = 2.0 * determinant - tt * (stiffness[..., 1, 1] - coupling * (ta + at))
    own = np.where(tt != 0.0, tt, np.nan) ** 2
    return FlutterRange(np.asarray((middle - root) / own), np.asarray((middle + root) / own))


def mechanism(eigenvalues: ComplexArray, undamped: ObjectArray) -> ObjectArray:
    """`Mechanism` (*G,) from the eigenvalues of a model (*G, n) and what it does without damping (*G,)."""
    growth, size = np.max(eigenvalues.real, axis=-1), np.max(np.abs(eigenvalues), axis=-1)
    grows, decays = growth > NEUTRAL * size, growth < -NEUTRAL * size
    fed = np.where(undamped == _word(Mechanism.NEUTRAL), _word(Mechanism.DAMPING_DRIVEN), undamped)
    calm = np.where(decays, _word(Mechanism.STABLE), _word(Mechanism.NEUTRAL))
    return np.where(grows, fed, calm)


def _determinant(K: FloatArray) -> FloatArray:
    return np.asarray(K[..., 0, 0] * K[..., 1, 1] - K[..., 0, 1] * K[..., 1, 0])


def _word(member: Mechanism) -> ObjectArray:
    """The member as an array of one object: numpy would make a plain string of it."""
    return np.array(member, dtype=object)
