"""Two controllers side by side on the wire."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from model.arrays import FloatArray
from schedules.compare import Carried, CommonPoints, Compared, figures
from service.presenters.grid import coordinates, grid_index
from service.wire.request_differences import MOST_LISTED, Difference
from service.wire.spec_names import spec_field


@dataclass(frozen=True)
class Flown:
    """A controller on the other plant at the common points, or why it is not flown there."""

    carried: Carried | None
    reason: str | None


def compare_document(
    idents: tuple[str, str],
    pair: tuple[Compared, Compared],
    differing: list[Difference],
    common: CommonPoints,
    flown: tuple[Flown, Flown],
) -> dict[str, Any]:
    """Requests, gains, figures and plants of two controllers; `flown` is each one on the other's plant."""
    this, other = pair
    gains, said = _gains(pair, common), _figures(pair, common)
    points = []
    for row, (here, there) in enumerate(zip(common.one.tolist(), common.other.tolist(), strict=True)):
        grids = this.envelope.plant.grid, other.envelope.plant.grid
        index, other_index = grid_index(grids[0], here), grid_index(grids[1], there)
        points.append(
            {
                "coordinates": coordinates(grids[0], index),
                "point": here,
                "other_point": there,
                "outcome": this.controller.outcomes.codes[index],
                "other_outcome": other.controller.outcomes.codes[other_index],
                "gains": [_at(name, unit, values, row) for name, unit, values in gains],
                "figures": [_at(name, unit, values, row) for name, unit, values in said],
                "on_other_plant": _carried(flown[0], row),
                "other_on_this_plant": _carried(flown[1], row),
            }
        )
    return {
        "this": _design(idents[0], this),
        "other": _design(idents[1], other),
        "request_differences": [
            {"pointer": d.pointer, "value": d.value, "other": d.other, "only_in": d.only_in}
            for d in differing[:MOST_LISTED]
        ],
        "request_differences_in_all": len(differing),
        "reason": common.reason,
        "on_other_plant": _summary(flown[0], common),
        "other_on_this_plant": _summary(flown[1], common),
        "points": points,
    }


def _design(ident: str, one: Compared) -> dict[str, Any]:
    return {
        "id": ident,
        "name": one.envelope.study.name,
        "controller": one.controller.request.name,
        "kind": one.controller.request.kind,
        "points": int(one.controller.outcomes.codes.size),
    }


#: A name, its unit, and the values of both at the common points; None where one does not have it.
_Row = tuple[str, str, tuple[FloatArray | None, FloatArray | None]]


def _gains(pair: tuple[Compared, Compared], common: CommonPoints) -> list[_Row]:
    this, other = (
        {gain.name: (gain.unit, gain.values.reshape(-1)[points]) for gain in one.controller.gains}
        for one, points in zip(pair, (common.one, common.other), strict=True)
    )
    names = {**this, **other}
    return [
        (name, unit, (this[name][1] if name in this else None, other[name][1] if name in other else None))
        for name, (unit, _) in names.items()
    ]


def _figures(pair: tuple[Compared, Compared], common: CommonPoints) -> list[_Row]:
    this, other = figures(pair[0].controller, common.one), figures(pair[1].controller, common.other)
    rows = []
    for quantity in {**this, **other}:
        field = spec_field(quantity, "max")
        values = (this.get(quantity), other.get(quantity))
        first, second = (None if each is None else np.asarray(each / field.scale) for each in values)
        rows.append((field.name.removesuffix("_max"), field.unit, (first, second)))
    return rows


def _at(name: str, unit: str, values: tuple[FloatArray | None, FloatArray | None], row: int) -> dict[str, Any]:
    value, other = (np.nan if each is None else float(each[row]) for each in values)
    known = np.isfinite(value) and np.isfinite(other)
    return {
        "name": name,
        "unit": unit,
        "value": value,
        "other": other,
        "difference": other - value if known else np.nan,
    }


def _carried(flown: Flown, row: int) -> dict[str, Any]:
    found = flown.carried
    if found is None or not found.flown[row]:
        return dict.fromkeys(("nu_gap", "stability_margin", "held_by_margin", "stable"))
    return {
        "nu_gap": float(found.nu_gap[row]),
        "stability_margin": float(found.margin[row]),
        "held_by_margin": bool(found.held[row]),
        "stable": bool(found.stable[row]),
    }


def _summary(flown: Flown, common: CommonPoints) -> dict[str, Any]:
    found = flown.carried
    if found is None or not found.flown.any():
        counts = {"points_flown": 0, "points_stable": 0, "points_held_by_margin": 0}
        return {"reason": flown.reason, **counts, "largest_nu_gap": None, "largest_nu_gap_point": None}
    worst = int(np.nanargmax(found.nu_gap))
    return {
        "reason": None,
        "points_flown": int(found.flown.sum()),
        "points_stable": int((found.stable & found.flown).sum()),
        "points_held_by_margin": int(found.held.sum()),
        "largest_nu_gap": float(found.nu_gap[worst]),
        "largest_nu_gap_point": int(common.one[worst]),
    }
