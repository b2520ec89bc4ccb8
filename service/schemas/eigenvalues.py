"""Answers about eigenvalues over a varied quantity."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from service.schemas.design import Grid, GridAir
from service.schemas.hinge_moments import HingeMomentFit
from service.schemas.point import Complex
from service.schemas.wire import Answer

Mechanism = Literal["stable", "neutral", "undamped_flutter", "damping_driven", "divergence"]


class Varied(Answer):
    """What varies, in which unit, and its values: the last axis of every array of a point."""

    name: str
    unit: str
    values: list[float] = Field(json_schema_extra={"unit": "see `unit`"})


class SweptModes(Answer):
    """Eigenvalues of one model along the values, in continuous branches; null where the model does not hold.

    `participation` is the share of each state in each branch (columns sum to one), [branch][state][value]; `output`
    the magnitude of each output in it, eigenvectors of unit length (seed 2.4.8), [branch][output][value].
    """

    states: list[str]
    outputs: list[str]
    branches: list[list[Complex | None]]
    omega_n_rad_s: list[list[float | None]]
    damping_ratio: list[list[float | None]]
    participation: list[list[list[float | None]]]
    output: list[list[list[float | None]]]
    growth_1_s: list[float | None] = Field(description="Largest real part")
    stable: list[bool | None]
    mechanism: list[Mechanism | None]


class FlutterCriterion(Answer):
    """Undamped flutter where ``left < right``, of inertia ratios and the stiffness divided by its norm."""

    inertia_ratio: list[float | None]
    inertia_coupling: list[float | None]
    left: list[float | None]
    right: list[float | None]
    discriminant: list[float | None]
    undamped: list[Mechanism | None]


class SweepVerdict(Answer):
    """Stability over all values: of the coupled model."""

    stable: bool | None
    mechanisms: list[Mechanism]
    largest_growth_1_s: float | None
    at: float | None = Field(json_schema_extra={"unit": "that of what is varied"})
    detail: str


class SweptPoint(Answer):
    """One grid point; the arrays run along the values."""

    index: int
    coordinates: dict[str, float]
    covered: list[bool]
    reasons: list[str | None]
    verdict: SweepVerdict
    coupled: SweptModes
    decoupled: SweptModes
    flutter_criterion: FlutterCriterion


class EigenvalueSweeps(Answer):
    """Eigenvalues of the coupled section, and of the aileron with the tab imposed, over one quantity."""

    grid: Grid
    air: GridAir
    hinge_moment_fit: HingeMomentFit | None
    varied: Varied
    points: list[SweptPoint]
