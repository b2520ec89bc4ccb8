"""Eigenvalues over one varied quantity: the coupled section, and the decoupled servo tab (seed 2.4)."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from model.arrays import BoolArray, FloatArray, GridArrays, ObjectArray
from model.flight import FlightCondition
from model.flutter import FlutterCriterion, Mechanism, flutter_criterion, mechanism
from model.linear_model import LinearModel
from model.linearise import linearise
from model.modes import Modes, tracked_modes
from model.servo_tab import servo_tab
from model.swept_plant import SWEPT, SweptPlant, SweptQuantity, spread_over, swept_plant
from model.system import TabAileron
from model.trim import TrimRequest, trim


@dataclass(frozen=True, eq=False)
class SweptModes(GridArrays):
    """One model along the sweep, (*G, m, ...): the swept value is the last grid axis.

    Attributes
    ----------
    modes : eigenvalues in continuous branches, and how outputs and states take part; nan where not covered
    growth : (*G, m) largest real part [1/s]
    mechanism : (*G, m) object, `Mechanism`; None where not covered
    states, outputs : names of the rows of ``modes.participation`` and ``modes.output``
    """

    modes: Modes
    growth: FloatArray
    mechanism: ObjectArray
    states: tuple[str, ...]
    outputs: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class EigenvalueSweep(GridArrays):
    """Eigenvalues over one quantity (*G, m, ...).

    Attributes
    ----------
    quantity, unit : what varies
    values : its values (m,)
    coupled : the whole model
    decoupled : the aileron with the tab imposed (seed 2.3.22)
    criterion : undamped flutter of the coupled model
    covered : (*G, m) False where the model does not hold or the trim is not reached
    reason : (*G, m) object, words there; else None
    """

    quantity: str
    unit: str
    values: tuple[float, ...]
    coupled: SweptModes
    decoupled: SweptModes
    criterion: FlutterCriterion
    covered: BoolArray
    reason: ObjectArray


def eigenvalue_sweep(
    system: TabAileron, condition: FlightCondition, request: TrimRequest, quantity: SweptQuantity, values: FloatArray
) -> EigenvalueSweep:
    """Vary one of the named quantities, everything else held, at every point of a grid.

    Parameters
    ----------
    system : one section (its geometry without grid axes)
    condition, request : base flight condition (*G) and trim
    quantity : see `SweptQuantity`
    values : (m,) in SI and radians, in the order to be followed

    Raises
    ------
    ValueError : an unknown quantity, a value that it cannot take, or no values
    """
    plant = swept_plant(system, condition, request, quantity, values)
    return sweep_plant(plant, values, quantity, SWEPT[quantity])


def sweep_plant(plant: SweptPlant, values: FloatArray, quantity: str, unit: str = "") -> EigenvalueSweep:
    """Eigenvalues of any section, condition and trim that vary along a last grid axis (*G, m).

    Parameters
    ----------
    plant : stacked along the values, whatever they mean
    values : (m,), with their name and unit for the answer
    """
    condition = spread_over(plant.condition, np.size(values))
    subsonic = plant.system.aerodynamics.covers(condition.mach)
    # A place outside the model still needs a finite number, which is covered up below.
    condition = replace(condition, mach=np.where(subsonic, condition.mach, 0.0))
    trimmed = trim(plant.system, condition, plant.request)
    angles = trimmed.state[..., 0], trimmed.state[..., 2]
    source = plant.system.aerodynamics.source
    known = source.covers(trimmed.alpha, *angles)
    reason = np.where(known | ~trimmed.reached, trimmed.reason, _words(f"trim outside {source.domain}"))
    reason = np.where(subsonic, reason, _words("outside the subsonic model (Mach < 1)"))
    covered = np.asarray(subsonic & trimmed.reached & known)
    return sweep_models(linearise(plant.system, condition, trimmed), values, quantity, unit, covered, reason)


def sweep_models(
    model: LinearModel,
    values: FloatArray,
    quantity: str,
    unit: str = "",
    covered: BoolArray | None = None,
    reason: ObjectArray | None = None,
) -> EigenvalueSweep:
    """Eigenvalues along the last grid axis (*G, m) of any stack of linear models.

    Parameters
    ----------
    model : stacked along the values; models that are not finite are not covered
    values : (m,), with their name and unit for the answer
    covered, reason : (*G, m) models that are not to be believed, and why

    Raises
    ------
    ValueError : no values, or not as many as models
    """
    grid = model.A.shape[:-2]
    if not grid or grid[-1] == 0 or grid[-1] != np.size(values):
        raise ValueError("a sweep needs at least one value, and one model for each value")
    finite = np.asarray(np.isfinite(model.A).all(axis=(-2, -1)))
    covered = np.asarray(finite if covered is None else finite & covered)
    reason = np.full(grid, None, dtype=object) if reason is None else np.broadcast_to(reason, grid)
    reason = np.where(finite, reason, _words("the linear model is not finite"))
    servo = servo_tab(model)
    A, inertia, stiffness, F = (
        np.where(finite[..., None, None], matrix, np.eye(matrix.shape[-1]))
        for matrix in (model.A, model.inertia, model.static_stiffness, servo.F)
    )
    C = np.where(finite[..., None, None], model.C, 0.0)
    criterion = flutter_criterion(inertia, stiffness)
    own = np.where(stiffness[..., 1, 1] <= 0.0, _words(Mechanism.NEUTRAL), _words(Mechanism.DIVERGENCE))
    return EigenvalueSweep(
        quantity=quantity,
        unit=unit,
        values=tuple(np.asarray(values, float).tolist()),
        coupled=_swept(A, C, criterion.undamped, covered, model.states, model.outputs),
        decoupled=_swept(F, np.eye(1, F.shape[-1]), own, covered, servo.states, ("da",)),
        criterion=criterion.take(covered).spread(covered),
        covered=covered,
        reason=reason,
    )


def _swept(
    A: FloatArray,
    C: FloatArray,
    undamped: ObjectArray,
    covered: BoolArray,
    states: tuple[str, ...],
    outputs: tuple[str, ...],
) -> SweptModes:
    """Modes of finite state matrices along the sweep, covered up where they mean nothing."""
    followed = tracked_modes(A, C)
    found = followed.take(covered)
    kind = mechanism(found.eigenvalues, undamped[covered])
    whole = SweptModes(found, np.max(found.eigenvalues.real, axis=-1), kind, states, outputs)
    return whole.spread(covered)


def _words(text: str) -> ObjectArray:
    return np.array(text, dtype=object)
