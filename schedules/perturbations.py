"""Plants that are not quite the modelled one: hinge-moment derivatives and inertias off by some part.

A perturbation multiplies parameters by factors, 1 being the model. The plant is linearised again about the *nominal*
trim: its hinge moments turn about the trim's angles, where they keep the nominal value, so angles and torques of the
trim stay what they are and a loop is flown in deviations from them. The damping of seed 2.2.12 follows the derivatives
by which the surfaces' motion is felt; quasi-steady rate derivatives, virtual inertia and lags are theory of the
section's geometry and keep their values.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Literal, get_args

import numpy as np
from scipy.special import erf, erfinv

from model.arrays import FloatArray, IntArray
from model.hinge_moments.derivatives import Derivatives
from model.linear_model import LinearModel
from model.linearise import linearise
from model.section import Body, Inertia
from model.system import TabAileron
from schedules.analysis import PlantEnvelope

#: What may be off. Derivatives are those at the trim [1/rad]; an inertia is about the body's own centre of mass.
Parameter = Literal[
    "C_Ha_da", "C_Ha_dt", "C_Ht_da", "C_Ht_dt",
    "aileron_inertia", "tab_inertia", "aileron_mass", "tab_mass", "aileron_cg_offset", "tab_cg_offset",
]  # fmt: skip
PARAMETERS: tuple[Parameter, ...] = get_args(Parameter)
#: Draws are made in blocks of this size, each block of each parameter from a stream of its own.
BLOCK = 256
#: More parameters than these have too many corners.
MOST_CORNER_PARAMETERS = 6
#: Draws of one request.
MOST_DRAWS = 100_000


@dataclass(frozen=True)
class Uncertainty:
    """How far a parameter may be from its nominal value.

    Attributes
    ----------
    parameter : one of `PARAMETERS`
    change : largest relative change, 0 < change < 1: the factor lies in ``[1 - change, 1 + change]``
    deviation : standard deviation of a normal distribution about 1, cut off at the largest change; None is uniform

    Raises
    ------
    ValueError : no such parameter, or a number out of range
    """

    parameter: Parameter
    change: float
    deviation: float | None = None

    def __post_init__(self) -> None:
        if self.parameter not in PARAMETERS:
            raise ValueError(f"parameter must be one of {', '.join(PARAMETERS)}, not {self.parameter!r}")
        if not 0.0 < self.change < 1.0:
            raise ValueError(f"{self.parameter}: change must be more than 0 and less than 1, is {self.change}")
        if self.deviation is not None and not 0.0 < self.deviation < np.inf:
            raise ValueError(f"{self.parameter}: deviation must be positive and finite, is {self.deviation}")


@dataclass(frozen=True, eq=False)
class Cases:
    """Perturbed plants to be flown, the same ones at every point of the grid.

    Attributes
    ----------
    parameters : which parameters are off, k of them
    factors : (D, k) what each is multiplied by; read-only

    Raises
    ------
    ValueError : a parameter named twice or unknown, or factors of another shape or not finite
    """

    parameters: tuple[Parameter, ...]
    factors: FloatArray

    def __post_init__(self) -> None:
        _check_names(self.parameters)
        factors = np.array(self.factors, dtype=float)
        if factors.ndim != 2 or factors.shape[1] != len(self.parameters) or not np.all(np.isfinite(factors)):
            raise ValueError(f"factors must be finite and one row a case of {len(self.parameters)} parameters")
        factors.flags.writeable = False
        object.__setattr__(self, "factors", factors)

    def __len__(self) -> int:
        """Number of cases D."""
        return len(self.factors)


def corner_cases(uncertainties: Sequence[Uncertainty]) -> Cases:
    """All 2^k corners ``1 +- change``, the sign of the last parameter changing fastest, from the lower end.

    Raises
    ------
    ValueError : no parameter, one twice, or more than `MOST_CORNER_PARAMETERS`
    """
    parameters = _parameters(uncertainties)
    if len(parameters) > MOST_CORNER_PARAMETERS:
        raise ValueError(f"{len(parameters)} parameters have too many corners: at most {MOST_CORNER_PARAMETERS}")
    signs = np.array(list(product((-1.0, 1.0), repeat=len(parameters))))
    return Cases(parameters, 1.0 + signs * np.array([u.change for u in uncertainties]))


def drawn_cases(uncertainties: Sequence[Uncertainty], draws: int, seed: int) -> Cases:
    """Independent random draws, which depend on the seed, the parameter and the number of the draw alone.

    The first draws of a longer request are those of a shorter one, and a parameter's are the same whichever others
    are drawn beside it, in whatever order.

    Parameters
    ----------
    draws : how many, 1 to `MOST_DRAWS`
    seed : not negative

    Raises
    ------
    ValueError : no parameter, one twice, or a number out of range
    """
    parameters = _parameters(uncertainties)
    if not 1 <= draws <= MOST_DRAWS:
        raise ValueError(f"draws must be 1 to {MOST_DRAWS}, is {draws}")
    if seed < 0:
        raise ValueError(f"seed must not be negative, is {seed}")
    columns = []
    for u in uncertainties:
        part = _between_0_and_1(PARAMETERS.index(u.parameter), draws, seed)
        if u.deviation is None:
            columns.append(1.0 + u.change * (2.0 * part - 1.0))
        else:
            wide = np.sqrt(2.0) * u.deviation
            away = wide * erfinv((2.0 * part - 1.0) * erf(u.change / wide))
            columns.append(1.0 + np.clip(away, -u.change, u.change))
    return Cases(parameters, np.stack(columns, axis=-1))


def _between_0_and_1(stream: int, draws: int, seed: int) -> FloatArray:
    """Uniform numbers (draws,), never 0 or 1, block by block."""
    blocks = [
        np.random.Generator(np.random.PCG64(np.random.SeedSequence(seed, spawn_key=(stream, block)))).random(BLOCK)
        for block in range(-(-draws // BLOCK))
    ]
    return np.asarray(np.concatenate(blocks)[:draws] * (1.0 - 2.0**-53) + 2.0**-54)


def _parameters(uncertainties: Sequence[Uncertainty]) -> tuple[Parameter, ...]:
    parameters = tuple(u.parameter for u in uncertainties)
    _check_names(parameters)
    return parameters


def _check_names(parameters: tuple[Parameter, ...]) -> None:
    if not parameters:
        raise ValueError("at least one parameter must be uncertain")
    for name in parameters:
        if name not in PARAMETERS:
            raise ValueError(f"parameter must be one of {', '.join(PARAMETERS)}, not {name!r}")
    if len(set(parameters)) != len(parameters):
        raise ValueError(f"a parameter is named twice: {', '.join(parameters)}")


def perturbed_model(
    plant: PlantEnvelope, points: IntArray, parameters: Sequence[Parameter], factors: FloatArray
) -> LinearModel:
    """Linear models (N,) of perturbed plants.

    Parameters
    ----------
    plant : the nominal plant over its grid
    points : (N,) flat indices of points inside the model
    parameters : names, k of them
    factors : (N, k) what each is multiplied by

    Raises
    ------
    ValueError : a factor that leaves a mass or an inertia which is not positive
    """
    by_name = dict(zip(parameters, np.moveaxis(factors, -1, 0), strict=True))
    at = np.unravel_index(points, plant.outcomes.ok.shape)
    condition, trim, moments = plant.grid.condition.take(at), plant.trim.take(at), plant.hinge_moments.take(at)
    aerodynamics = plant.system.aerodynamics
    # The envelope's hinge moments hold the compressibility that linearise is about to multiply by.
    factor = aerodynamics.amplification(condition.mach)
    value, gradient = moments.value / factor[:, None], moments.gradient / factor[:, None, None]
    tab, aileron = gradient[:, 0, :], gradient[:, 1, :]
    source = Derivatives(
        C_Ha_0=value[:, 1], C_Ha_alpha=aileron[:, 0],
        C_Ha_da=aileron[:, 2] * by_name.get("C_Ha_da", 1.0), C_Ha_dt=aileron[:, 1] * by_name.get("C_Ha_dt", 1.0),
        C_Ht_0=value[:, 0], C_Ht_alpha=tab[:, 0],
        C_Ht_da=tab[:, 2] * by_name.get("C_Ht_da", 1.0), C_Ht_dt=tab[:, 1] * by_name.get("C_Ht_dt", 1.0),
        alpha0=trim.alpha, da0=trim.state[:, 2], dt0=trim.state[:, 0],
    )  # fmt: skip
    bodies = plant.system.inertia
    inertia = Inertia(
        aileron=_perturbed_body(bodies.aileron, "aileron", by_name), tab=_perturbed_body(bodies.tab, "tab", by_name)
    )
    system = TabAileron(plant.system.geometry, inertia, replace(aerodynamics, source=source))
    return linearise(system, condition, trim)


def _perturbed_body(body: Body, name: str, factors: dict[Parameter, FloatArray]) -> Body:
    by = {str(parameter): factor for parameter, factor in factors.items()}
    return Body(
        mass=body.mass * by.get(f"{name}_mass", 1.0),
        cg_offset=body.cg_offset * by.get(f"{name}_cg_offset", 1.0),
        inertia=body.inertia * by.get(f"{name}_inertia", 1.0),
    )
