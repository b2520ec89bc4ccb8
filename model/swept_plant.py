"""Sections, conditions and trims with one quantity varied along a last grid axis (seed 2.4)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from typing import Final, Literal, get_args

import numpy as np

from model.arrays import FloatArray
from model.atmosphere import Air
from model.flight import FlightCondition
from model.hinge_moments.thin_aerofoil import ThinAerofoil
from model.system import TabAileron
from model.trim_request import TrimRequest

#: What `swept_plant` can vary: the trim's angles [rad]; the true airspeed [m/s] in the same air; the density
#: [kg/m^3] at the same airspeed and temperature; the tab's chord as a fraction of the aileron's [-].
SweptQuantity = Literal["tab", "aileron", "alpha", "airspeed", "density", "tab_chord_ratio"]


@dataclass(frozen=True)
class SweptPlant:
    """A section, its flight condition and its trim; some of them vary along the last grid axis (*G, m).

    Arrays of the section itself (hinges, inertias) have the shape (m,).
    """

    system: TabAileron
    condition: FlightCondition
    request: TrimRequest


def swept_plant(
    system: TabAileron, condition: FlightCondition, request: TrimRequest, quantity: SweptQuantity, values: FloatArray
) -> SweptPlant:
    """The plant with `quantity` at each of `values` (m,), everything else as given.

    Parameters
    ----------
    system : one section, its geometry and inertias single numbers
    condition : (*G); gets the axis of the values at its end
    request : the trim; its arrays, if any, have the shape (*G) too

    Raises
    ------
    ValueError : an unknown quantity, a value that it cannot take, or hinges varied for a source of hinge moments
        that is not thin-aerofoil theory
    """
    if quantity not in get_args(SweptQuantity):
        raise ValueError(f"quantity must be one of {get_args(SweptQuantity)}, not {quantity!r}")
    values = np.asarray(values, float)
    if values.ndim != 1 or values.size == 0 or not np.all(np.isfinite(values)):
        raise ValueError("the values of a sweep must be a list of finite numbers, at least one of them")
    base = SweptPlant(system, condition.take((..., None)), with_sweep_axis(request))
    return _VARY[quantity](base, values)


def with_sweep_axis(request: TrimRequest) -> TrimRequest:
    """The request with one more axis at the end of its arrays (*G)."""

    def axis(value: object) -> object:
        return value[..., None] if isinstance(value, np.ndarray) else value

    changed = {name: axis(getattr(request, name)) for name in ("alpha", "aileron", "tab")}
    for name in ("aileron", "tab"):
        held = getattr(request, f"{name}_torque")
        if held is not None and not isinstance(changed[name], str):
            changed[name] = replace(held, torque=axis(held.torque))
    return replace(request, **changed)  # type: ignore[arg-type]


def _vary_tab(plant: SweptPlant, values: FloatArray) -> SweptPlant:
    return replace(plant, request=replace(plant.request, tab=values))


def _vary_aileron(plant: SweptPlant, values: FloatArray) -> SweptPlant:
    return replace(plant, request=replace(plant.request, aileron=values))


def _vary_alpha(plant: SweptPlant, values: FloatArray) -> SweptPlant:
    return replace(plant, request=replace(plant.request, alpha=values))


def _vary_airspeed(plant: SweptPlant, values: FloatArray) -> SweptPlant:
    if np.any(values <= 0.0):
        raise ValueError("airspeed must be positive [m/s]")
    return replace(plant, condition=moving_through(plant.condition.air, values))


def _vary_density(plant: SweptPlant, values: FloatArray) -> SweptPlant:
    if np.any(values <= 0.0):
        raise ValueError("density must be positive [kg/m^3]")
    air = plant.condition.air
    # Air of the same temperature at another pressure: at no altitude of the standard atmosphere.
    thin = replace(
        air,
        altitude=np.full(np.broadcast_shapes(np.shape(air.density), values.shape), np.nan),
        pressure=np.asarray(air.pressure * (values / air.density)),
        density=np.asarray(values + 0.0 * air.density),
    )
    return replace(plant, condition=moving_through(thin, plant.condition.airspeed))


def _vary_tab_chord_ratio(plant: SweptPlant, values: FloatArray) -> SweptPlant:
    if np.any((values <= 0.0) | (values >= 1.0)):
        raise ValueError("tab_chord_ratio must lie between 0 and 1 (fraction of the aileron's chord)")
    system, source = plant.system, plant.system.aerodynamics.source
    if not isinstance(source, ThinAerofoil):
        raise ValueError(
            "the tab's chord can be varied for thin-aerofoil hinge moments only: others hold for one hinge"
        )
    hinge = 1.0 - values * (1.0 - system.geometry.aileron_hinge)
    aerodynamics = replace(system.aerodynamics, source=replace(source, tab_hinge=hinge))
    geometry = replace(system.geometry, tab_hinge=hinge)
    return replace(plant, system=replace(system, geometry=geometry, aerodynamics=aerodynamics))


def moving_through(air: Air, airspeed: FloatArray) -> FlightCondition:
    """Flight condition from the air and the true airspeed [m/s], which broadcast (*G)."""
    airspeed = np.asarray(airspeed + 0.0 * air.density)
    return FlightCondition(
        air, airspeed, np.asarray(0.5 * air.density * airspeed**2), np.asarray(airspeed / air.speed_of_sound)
    )


def spread_over(condition: FlightCondition, count: int) -> FlightCondition:
    """The condition (*G, m) or (*G, 1) with every array in the shape (*G, m), for `count` swept values m."""
    shape = np.broadcast_shapes(np.shape(condition.mach), np.shape(condition.air.density), (count,))

    def whole(part: Air | FlightCondition, skip: str = "") -> dict[str, FloatArray]:
        names = [field.name for field in fields(part) if field.name != skip]
        return {name: np.broadcast_to(getattr(part, name), shape) for name in names}

    return FlightCondition(air=Air(**whole(condition.air)), **whole(condition, skip="air"))


#: Unit of each quantity.
SWEPT: Final[dict[SweptQuantity, str]] = {
    "tab": "rad", "aileron": "rad", "alpha": "rad", "airspeed": "m/s", "density": "kg/m^3", "tab_chord_ratio": "1",
}  # fmt: skip

_VARY: Final[dict[SweptQuantity, Callable[[SweptPlant, FloatArray], SweptPlant]]] = {
    "tab": _vary_tab,
    "aileron": _vary_aileron,
    "alpha": _vary_alpha,
    "airspeed": _vary_airspeed,
    "density": _vary_density,
    "tab_chord_ratio": _vary_tab_chord_ratio,
}
