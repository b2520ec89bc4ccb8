"""Eigenvalue sweeps on the wire: branches along the values at each grid point, and what decides stability."""

from __future__ import annotations

from typing import Any

import numpy as np

from model.arrays import ObjectArray
from model.eigenvalue_sweep import EigenvalueSweep, SweptModes
from model.flutter import FlutterCriterion, Mechanism
from service.presenters.grid import air_document, coordinates, grid_document, grid_index
from service.presenters.hinge_moments import fit_document
from service.studies.sweeps import Swept


def sweep_document(swept: Swept) -> dict[str, Any]:
    """The answer to a request for an eigenvalue sweep."""
    size = int(np.prod(swept.grid.shape))
    return {
        "grid": grid_document(swept.grid),
        "air": air_document(swept.grid.condition),
        "hinge_moment_fit": fit_document(swept.system.aerodynamics.source),
        "varied": {"name": swept.name, "unit": swept.unit, "values": list(swept.values)},
        "points": [_point(swept, point) for point in range(size)],
    }


def _point(swept: Swept, point: int) -> dict[str, Any]:
    index = grid_index(swept.grid, point)
    sweep = swept.sweep.take(index)
    return {
        "index": point,
        "coordinates": coordinates(swept.grid, index),
        "covered": sweep.covered,
        "reasons": sweep.reason,
        "verdict": _verdict(swept, sweep),
        "coupled": _modes(sweep.coupled),
        "decoupled": _modes(sweep.decoupled),
        "flutter_criterion": _criterion(sweep.criterion),
    }


def _modes(swept: SweptModes) -> dict[str, Any]:
    """Arrays (m, ...) along the values turned to [branch][...][value]."""
    modes = swept.modes
    return {
        "states": list(swept.states),
        "outputs": list(swept.outputs),
        "branches": modes.eigenvalues.T,
        "omega_n_rad_s": modes.natural_frequency.T,
        "damping_ratio": modes.damping_ratio.T,
        "participation": modes.participation.T,
        "output": modes.output.T,
        "growth_1_s": swept.growth,
        "stable": _stable(swept.mechanism),
        "mechanism": swept.mechanism,
    }


def _stable(mechanism: ObjectArray) -> list[bool | None]:
    """Whether each model decays; None where it does not hold."""
    return [None if kind is None else kind is Mechanism.STABLE for kind in mechanism]


def _criterion(criterion: FlutterCriterion) -> dict[str, Any]:
    return {
        "inertia_ratio": criterion.inertia_ratio,
        "inertia_coupling": criterion.inertia_coupling,
        "left": criterion.left,
        "right": criterion.right,
        "discriminant": criterion.discriminant,
        "undamped": criterion.undamped,
    }


def _verdict(swept: Swept, sweep: EigenvalueSweep) -> dict[str, Any]:
    """Whether the coupled model is stable at every value that it holds at, and where it is worst."""
    held = sweep.covered
    if not np.any(held):
        nothing = dict.fromkeys(("stable", "largest_growth_1_s", "at"))
        return {**nothing, "mechanisms": [], "detail": "the model holds at none of the values"}
    kinds = [Mechanism(kind) for kind in sweep.coupled.mechanism[held]]
    worst = int(np.nanargmax(sweep.coupled.growth))
    stable = sum(kind is Mechanism.STABLE for kind in kinds)
    return {
        "stable": stable == len(kinds),
        "mechanisms": sorted(set(kinds)),
        "largest_growth_1_s": sweep.coupled.growth[worst],
        "at": swept.values[worst],
        "detail": f"stable at {stable} of {len(kinds)} values" + _beyond(len(held) - len(kinds)),
    }


def _beyond(count: int) -> str:
    return f"; the model does not hold at {count} more" if count else ""
