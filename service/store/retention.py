"""What is let go in time: designs that nobody uses, jobs that ended, answers kept for repeated requests."""

from __future__ import annotations

import re
from dataclasses import dataclass

from sqlalchemy import Connection, delete, func, select

from service.store.database import Database
from service.store.jobs import unpacked
from service.store.tables import designs, jobs, repeated

_DAY = 86400.0
#: For how long a request with an ``Idempotency-Key`` is answered the same [s].
REPEATED = _DAY
#: Jobs that are not over.
_UNFINISHED = ("queued", "running", "cancelling")
_ID = re.compile(rb"(?<![0-9a-f])[0-9a-f]{32}(?![0-9a-f])")
#: Rows deleted by one statement.
_AT_ONCE = 500


@dataclass(frozen=True)
class Kept:
    """What is kept.

    Attributes
    ----------
    days : how long a design is kept that nobody uses [d]; None: for ever
    stored_bytes : bytes of all designs, above which those go that were not used for longest; None: any
    job_days : how long a job is kept after its end [d]
    """

    days: float | None
    stored_bytes: int | None
    job_days: float


@dataclass(frozen=True)
class LetGo:
    """How many designs, jobs and answers to repeated requests went."""

    designs: int
    jobs: int
    repeated: int


def let_go(database: Database, kept: Kept, now: float) -> LetGo:
    """Delete the rows of what is not kept any longer; their files are orphans then.

    A design that a job is still about stays. Several processes may do this at once.

    Parameters
    ----------
    now : seconds since 1970

    Raises
    ------
    StoreUnavailable
    """
    with database.writing() as connection:
        answers = connection.execute(delete(repeated).where(repeated.c.created_at < now - REPEATED)).rowcount
        over = ~jobs.c.state.in_(_UNFINISHED) & (jobs.c.finished_at < now - kept.job_days * _DAY)
        ended = connection.execute(delete(jobs).where(over)).rowcount
        unused = _unused(connection, kept, now)
        gone = 0
        for start in range(0, len(unused), _AT_ONCE):
            some = unused[start : start + _AT_ONCE]
            gone += connection.execute(delete(designs).where(designs.c.id.in_(some))).rowcount
    return LetGo(gone, ended, answers)


def _unused(connection: Connection, kept: Kept, now: float) -> list[str]:
    """Ids of the designs that are not kept, longest unused first."""
    oldest = -float("inf") if kept.days is None else now - kept.days * _DAY
    over = 0
    if kept.stored_bytes is not None:
        over = int(connection.scalar(select(func.sum(designs.c.bytes))) or 0) - kept.stored_bytes
    if kept.days is None and over <= 0:
        return []
    needed, chosen = _needed(connection), []
    by_use = select(designs.c.id, designs.c.used_at, designs.c.bytes).order_by(designs.c.used_at, designs.c.id)
    for ident, used_at, size in connection.execute(by_use):
        if used_at >= oldest and over <= 0:
            break
        if ident not in needed:
            chosen.append(ident)
            over -= size
    return chosen


def _needed(connection: Connection) -> set[str]:
    """Ids that jobs which are not over speak of."""
    wanted = select(jobs.c.spec, jobs.c.result).where(jobs.c.state.in_(_UNFINISHED))
    texts = ((unpacked(spec), (result or "").encode()) for spec, result in connection.execute(wanted))
    return {ident.decode() for pair in texts for part in pair for ident in _ID.findall(part)}
