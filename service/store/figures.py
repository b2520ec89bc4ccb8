"""Figures of what is stored, for those who watch the server."""

from __future__ import annotations

from dataclasses import dataclass

from sqlalchemy import func, select

from service.store.database import Database
from service.store.tables import designs, jobs


@dataclass(frozen=True)
class Figures:
    """How many designs there are, their bytes, and jobs by their state."""

    designs: int
    design_bytes: int
    jobs: dict[str, int]


def figures(database: Database) -> Figures:
    """Count what is stored.

    Raises
    ------
    StoreUnavailable
    """
    with database.reading() as connection:
        count, size = connection.execute(select(func.count(), func.coalesce(func.sum(designs.c.bytes), 0))).one()
        states = connection.execute(select(jobs.c.state, func.count()).group_by(jobs.c.state)).all()
    return Figures(int(count), int(size), {state: int(number) for state, number in states})
