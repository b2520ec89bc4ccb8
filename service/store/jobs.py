"""Jobs: queued, claimed by a runner, their finished tasks kept, ended; and the lease that makes a runner the one."""

from __future__ import annotations

import time
import zlib
from collections.abc import Collection
from dataclasses import dataclass
from typing import Any, Literal

from sqlalchemy import ColumnElement, Connection, Update, delete, func, insert, select, update
from sqlalchemy.exc import IntegrityError

from service.store.blobs import Blobs
from service.store.database import Database
from service.store.designs import LOCAL
from service.store.tables import chunks, jobs, leases
from service.wire.refusals import StoreUnavailable

State = Literal["queued", "running", "cancelling", "cancelled", "failed", "succeeded"]
#: States in which a job stays until somebody asks for it again.
ENDED = ("cancelled", "failed", "succeeded")


@dataclass(frozen=True)
class Job:
    """A job as it stands, without what it is about.

    Attributes
    ----------
    seq : counts up with time
    id, owner, kind : which work, whose, of which kind
    state : where it is; `ENDED` are final
    done, total : finished tasks, and all
    revision : counts the changes of the job
    attempts : how often a runner took it up
    result : path of the result; None before it succeeded
    result_blob : digest of the result where it is kept as a file
    error : problem document, JSON; None unless it failed
    created_at, started_at, finished_at : seconds since 1970; None before it happened
    """

    seq: int
    id: str
    owner: str
    kind: str
    state: State
    done: int
    total: int
    revision: int
    attempts: int
    result: str | None
    result_blob: str | None
    error: str | None
    created_at: float
    started_at: float | None
    finished_at: float | None

    @property
    def ended(self) -> bool:
        """Whether nothing more happens to it."""
        return self.state in ENDED


@dataclass(frozen=True)
class NewJob:
    """Work to be queued: the id says which, so that the same work asked for twice is one job.

    `spec` is what its tasks follow from, `total` how many these are.
    """

    id: str
    kind: str
    spec: bytes
    total: int


_COLUMNS = [jobs.c[name] for name in Job.__dataclass_fields__]


class JobStore:
    """The jobs of a database.

    Where an `owner` may be given, None stands for one who sees everything. A runner says which attempt it is at, so
    that one which lost its lease changes nothing any more.

    Raises
    ------
    StoreUnavailable : from every method, when the database or a file cannot be read or written
    """

    def __init__(self, database: Database, blobs: Blobs) -> None:
        self._database = database
        self._blobs = blobs

    def add(self, new: NewJob, most_queued: int, again: bool = True, owner: str = LOCAL) -> Job | None:
        """Queue a job, or return the one under its id that has not ended; None when `most_queued` jobs wait.

        One that failed or was cancelled is queued again, one that succeeded when `again` says so.
        """
        with self._database.writing() as connection:
            before = _job(connection, jobs.c.id == new.id)
            if before is not None and (not before.ended or (before.state == "succeeded" and not again)):
                return before
            waiting = connection.execute(select(func.count()).where(jobs.c.state == "queued")).scalar_one()
            if waiting >= most_queued:
                return None
            fresh = {
                "state": "queued", "spec": packed(new.spec), "done": 0, "total": new.total, "result": None,
                "result_blob": None, "error": None, "created_at": time.time(), "started_at": None, "finished_at": None,
            }  # fmt: skip
            if before is not None:
                connection.execute(_changed(jobs.c.id == new.id).values(fresh))
            else:
                names = {"id": new.id, "owner": owner, "kind": new.kind, "revision": 1, "attempts": 0}
                _insert_unless_there(connection, insert(jobs).values(fresh | names))
            return _job(connection, jobs.c.id == new.id)

    def get(self, ident: str, owner: str | None = None) -> Job | None:
        """The job under this id, None when there is none, or none of this owner's."""
        with self._database.reading() as connection:
            return _job(connection, jobs.c.id == ident, *_of(owner))

    def page(self, limit: int, before: int | None = None, owner: str | None = None) -> list[Job]:
        """At most `limit` jobs, newest first, queued before the one whose `seq` is given."""
        wanted = select(*_COLUMNS).where(*_of(owner)).order_by(jobs.c.seq.desc()).limit(limit)
        if before is not None:
            wanted = wanted.where(jobs.c.seq < before)
        with self._database.reading() as connection:
            return [Job(*row) for row in connection.execute(wanted)]

    def waiting(self) -> list[str]:
        """Owners of the jobs that wait, those whose first job waits longest before others."""
        first = func.min(jobs.c.seq)
        wanted = select(jobs.c.owner).where(jobs.c.state == "queued").group_by(jobs.c.owner).order_by(first)
        with self._database.reading() as connection:
            return list(connection.execute(wanted).scalars())

    def claim(self, owner: str) -> tuple[Job, bytes] | None:
        """Take up the job of this owner that waits longest, and what it is about; None when none waits."""
        first = select(func.min(jobs.c.seq)).where(jobs.c.state == "queued", jobs.c.owner == owner).scalar_subquery()
        values = {
            "state": "running",
            "attempts": jobs.c.attempts + 1,
            "started_at": func.coalesce(jobs.c.started_at, time.time()),
        }
        taken = _changed(jobs.c.seq == first, jobs.c.state == "queued").values(values)
        with self._database.writing() as connection:
            row = connection.execute(taken.returning(*_COLUMNS, jobs.c.spec)).first()
        return None if row is None else (Job(*row[:-1]), unpacked(row[-1]))

    def chunks(self, ident: str) -> dict[int, bytes]:
        """Results of the finished tasks of a job by their numbers; those whose file is lost or damaged left out."""
        found = {}
        with self._database.reading() as connection:
            rows = connection.execute(select(chunks.c.number, chunks.c.result_blob).where(chunks.c.job_id == ident))
            digests = {row.number: row.result_blob for row in rows}
        for number, digest in digests.items():
            try:
                found[number] = self._blobs.get(digest)
            except StoreUnavailable:  # it is worked out again
                continue
        return found

    def record(self, ident: str, attempt: int, number: int, result: bytes) -> bool:
        """Keep the result of a task of a running job; False when the job is not this runner's any more."""
        digest = self._blobs.put(result)
        of_job = chunks.c.job_id == ident
        with self._database.writing() as connection:
            if not _touch(connection, ident, attempt, "running", "cancelling"):
                return False
            connection.execute(delete(chunks).where(of_job, chunks.c.number == number))
            connection.execute(insert(chunks).values(job_id=ident, number=number, result_blob=digest))
            done = select(func.count()).select_from(chunks).where(of_job).scalar_subquery()
            connection.execute(update(jobs).where(jobs.c.id == ident).values(done=done))
        return True

    def finish(self, ident: str, attempt: int, result: str, content: bytes | None = None) -> bool:
        """The job succeeded: its result is at this path, and these bytes; False when it is not to be finished."""
        digest = None if content is None else self._blobs.put(content)
        return self._end(ident, attempt, "succeeded", {"result": result, "result_blob": digest, "done": jobs.c.total})

    def fail(self, ident: str, attempt: int, error: str) -> bool:
        """The job failed with this problem document; False when it is not this runner's any more."""
        return self._end(ident, attempt, "failed", {"error": error})

    def cancelled(self, ident: str, attempt: int) -> bool:
        """The job that was asked to stop has stopped; False when it was not asked, or is not this runner's."""
        return self._end(ident, attempt, "cancelled", {}, "cancelling")

    def park(self, ident: str, attempt: int) -> bool:
        """Leave a running job to the next runner, its finished tasks kept."""
        with self._database.writing() as connection:
            return _touch(connection, ident, attempt, "running", values={"state": "queued"})

    def ask_to_cancel(self, ident: str, owner: str | None = None) -> Job | None:
        """Cancel a job that waits, ask a running one to stop, leave others as they are; None when there is none."""
        this = (jobs.c.id == ident, *_of(owner))
        gone = {"state": "cancelled", "spec": b"", "finished_at": time.time()}
        with self._database.writing() as connection:
            stopped = connection.execute(_changed(*this, jobs.c.state == "queued").values(gone)).rowcount
            if stopped:
                connection.execute(delete(chunks).where(chunks.c.job_id == ident))
            connection.execute(_changed(*this, jobs.c.state == "running").values(state="cancelling"))
            return _job(connection, *this)

    def cancelling(self) -> set[str]:
        """Ids of the jobs that were asked to stop."""
        with self._database.reading() as connection:
            return set(connection.execute(select(jobs.c.id).where(jobs.c.state == "cancelling")).scalars())

    def forget(self, ident: str) -> None:
        """Drop a job that has ended."""
        with self._database.writing() as connection:
            connection.execute(delete(jobs).where(jobs.c.id == ident, jobs.c.state.in_(ENDED)))

    def result(self, job: Job) -> bytes:
        """The bytes that the job was finished with."""
        return self._blobs.get(job.result_blob or "")

    def requeue(self, kept: Collection[str] = ()) -> None:
        """What a runner that is gone has left: running jobs wait again with their finished tasks, others are cancelled.

        For the holder of the lease only, but for the jobs that it has at hand itself (`kept`).
        """
        left = select(jobs.c.id).where(jobs.c.id.not_in(kept))
        with self._database.writing() as connection:
            running = list(connection.execute(left.where(jobs.c.state == "running")).scalars())
            stopping = list(connection.execute(left.where(jobs.c.state == "cancelling")).scalars())
            if running:
                connection.execute(_changed(jobs.c.id.in_(running)).values(state="queued"))
            if stopping:
                gone = {"state": "cancelled", "spec": b"", "finished_at": time.time()}
                connection.execute(delete(chunks).where(chunks.c.job_id.in_(stopping)))
                connection.execute(_changed(jobs.c.id.in_(stopping)).values(gone))

    def lease(self, name: str, holder: str, seconds: float) -> Literal["taken", "kept"] | None:
        """Have a role from now on for so long: taken over, or kept for longer; None while somebody else has it."""
        now = time.time()
        role, mine = leases.c.name == name, leases.c.holder == holder
        values = {"holder": holder, "until": now + seconds}
        with self._database.writing() as connection:
            if connection.execute(update(leases).where(role, mine, leases.c.until >= now).values(values)).rowcount:
                return "kept"
            if connection.execute(update(leases).where(role, leases.c.until < now).values(values)).rowcount:
                return "taken"
            there = connection.execute(select(leases.c.name).where(role)).first()
            if there is None and _insert_unless_there(connection, insert(leases).values(name=name, **values)):
                return "taken"
        return None

    def release(self, name: str, holder: str) -> None:
        """Give a role back."""
        with self._database.writing() as connection:
            connection.execute(delete(leases).where(leases.c.name == name, leases.c.holder == holder))

    def _end(self, ident: str, attempt: int, state: State, values: dict[str, Any], *before: State) -> bool:
        """End a job, forgetting what it was about and its finished tasks."""
        values = {**values, "state": state, "spec": b"", "finished_at": time.time()}
        with self._database.writing() as connection:
            ended = _touch(connection, ident, attempt, *(before or ("running",)), values=values)
            if ended:
                connection.execute(delete(chunks).where(chunks.c.job_id == ident))
        return ended


def packed(spec: bytes) -> bytes:
    """What a job is about as its row holds it: specs hold whole designs."""
    return zlib.compress(spec)


def unpacked(kept: bytes) -> bytes:
    """What the row of a job is about; nothing once it has ended."""
    return zlib.decompress(kept) if kept else b""


def _job(connection: Connection, *which: ColumnElement[bool]) -> Job | None:
    row = connection.execute(select(*_COLUMNS).where(*which)).first()
    return None if row is None else Job(*row)


def _of(owner: str | None) -> tuple[ColumnElement[bool], ...]:
    return () if owner is None else (jobs.c.owner == owner,)


def _changed(*which: ColumnElement[bool]) -> Update:
    """A change of these jobs, which counts as one."""
    return update(jobs).where(*which).values(revision=jobs.c.revision + 1)


def _touch(
    connection: Connection, ident: str, attempt: int, *states: str, values: dict[str, Any] | None = None
) -> bool:
    """Change a job in one of these states that this attempt is at; whether there was one."""
    mine = (jobs.c.id == ident, jobs.c.attempts == attempt, jobs.c.state.in_(states))
    return bool(connection.execute(_changed(*mine).values(values or {})).rowcount)


def _insert_unless_there(connection: Connection, statement: Any) -> bool:
    """Insert a row; False when another process just inserted it."""
    try:
        with connection.begin_nested():
            connection.execute(statement)
    except IntegrityError:
        return False
    return True
