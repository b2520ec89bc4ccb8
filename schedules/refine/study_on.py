"""A study on other lines than its own: what it gives point by point is read between them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from design.classical.controller import ClassicalController
from design.specs import Spec
from model.arrays import Floats
from schedules.proof.plant_terms import given_point_by_point
from schedules.refine.lines import Lines, read_between
from schedules.study import Controller, Study


def study_on(study: Study, request: Controller, lines: Lines) -> Study:
    """The study with the grid of `lines` and one controller, `request`.

    Limits of specs and gains that vary over the study's grid are multilinear between its points, and beyond them those
    of its edges.

    Raises
    ------
    ValueError : a trim that is given grid point by grid point: nothing says what it is on other lines
    """
    if given_point_by_point(study.trim):
        raise ValueError("the trim is given grid point by grid point: nothing says what it is on other lines")
    grid = replace(study.grid, altitude=lines.altitude, speed=lines.speed)
    specs = tuple(spec_on(study, spec, lines) for spec in study.spec_pack)
    return replace(study, grid=grid, controllers=(_request_on(study, request, lines),), spec_pack=specs)


def spec_on(study: Study, spec: Spec, lines: Lines) -> Spec:
    """A spec of the study with its limit on other lines."""
    return replace(spec, limit=_values_on(study, spec.limit, lines))


def kinks(study: Study, request: Controller) -> Lines:
    """Lines along which something that is asked for point by point changes its slope; none where nothing is."""
    given = [spec.limit for spec in study.spec_pack]
    if isinstance(request, ClassicalController):
        given += [*(spec.limit for spec in request.specs), *request.gains.values()]
    if all(np.ndim(values) == 0 for values in given):
        return Lines((), ())
    return Lines(study.grid.altitude, study.grid.speed)


def _request_on(study: Study, request: Controller, lines: Lines) -> Controller:
    if not isinstance(request, ClassicalController):
        return request
    specs = tuple(spec_on(study, spec, lines) for spec in request.specs)
    return replace(request, specs=specs, gains={n: _values_on(study, v, lines) for n, v in request.gains.items()})


def _values_on(study: Study, values: Floats, lines: Lines) -> Floats:
    if np.ndim(values) == 0:
        return values
    own = Lines(study.grid.altitude, study.grid.speed)
    return read_between(own, np.broadcast_to(np.asarray(values, dtype=float), own.shape), lines)
