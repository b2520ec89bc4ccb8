"""What becomes of a design that is slowed down to an actuator's limits: the result that both kinds of search give."""

from __future__ import annotations

from dataclasses import dataclass

from model.arrays import FloatArray, ObjectArray
from schedules.designed import DesignedController


@dataclass(frozen=True, eq=False)
class Slower:
    """A design within limits, and what it took.

    Attributes
    ----------
    designed : judged as every design is; points that cannot be slowed enough have an outcome with its reason
    steered_by : (*G,) object array of str, what slowed the design down; None where nothing did
    factor : (*G,) by how much: of a state feedback the price of its actuator over what it was, of a tab-only
        controller the peak rate of its tab; 1 where nothing was needed, nan where nothing helps
    least : (*G, k) where nothing helps, how near to the limits it comes: the peaks of the nearest trial, or the least
        that a quantity reaches by itself; nan elsewhere, and for a quantity of which nothing is known
    """

    designed: DesignedController
    steered_by: ObjectArray
    factor: FloatArray
    least: FloatArray
