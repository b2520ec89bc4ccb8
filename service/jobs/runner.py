"""The runner: a thread that takes jobs from the store to the workers and brings results back, one process at a time."""

from __future__ import annotations

import logging
import secrets
import time
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass
from functools import partial
from threading import Event, Thread

import orjson

from service.jobs.executors import Executor
from service.jobs.outcome import Outcome
from service.jobs.running import RunningJob
from service.jobs.turns import Turns
from service.store.jobs import Job, JobStore
from service.store.store import Store
from service.version import code_version
from service.wire.errors import problem
from service.wire.refusals import StoreUnavailable

#: Name of the lease.
ROLE = "runner"
#: How often the store is looked at for jobs and cancellations of other processes: with jobs at hand, and without [s].
_LOOK, _IDLE_LOOK = 0.2, 0.5
#: Waits after failures of the store or of the cluster: the first, and the longest [s].
_BACK_OFF, _LONGEST_BACK_OFF = 0.1, 2.0

log = logging.getLogger("gainfield")


@dataclass(frozen=True)
class _Landed:
    """A task whose future has ended."""

    job: RunningJob
    number: int
    future: Future[bytes]


class Runner:
    """Runs the jobs of a store while it has the lease.

    Parameters
    ----------
    start_workers : makes the executor, when there is work for it
    most_running : jobs at the same time
    lease : how long the role stays with a process that does not renew it [s]
    """

    def __init__(self, store: Store, start_workers: Callable[[], Executor], most_running: int, lease: float) -> None:
        self._store = store
        self._jobs: JobStore = store.jobs
        self._start_workers = start_workers
        self._most_running = most_running
        self._lease = lease
        self._holder = secrets.token_hex(16)
        self._executor: Executor | None = None
        self._running: dict[str, RunningJob] = {}
        self._landed: deque[_Landed] = deque()
        self._claims, self._dispatches = Turns(), Turns()
        self._leading = False
        self._until = self._renew_at = 0.0
        self._wake, self._stopping = Event(), Event()
        self._thread = Thread(target=self._run, name="job-runner", daemon=True)

    def start(self) -> None:
        """Begin."""
        self._thread.start()

    def wake(self) -> None:
        """There is something to do: a new job, or one to cancel."""
        self._wake.set()

    def stop(self) -> None:
        """End, leaving running jobs to the next runner with their finished tasks; waits until that is done."""
        self._stopping.set()
        self._wake.set()
        self._thread.join()

    def _run(self) -> None:
        pause = _BACK_OFF
        while not self._stopping.is_set():
            self._wake.clear()
            try:
                self._step()
                pause = _BACK_OFF
                self._wake.wait(_LOOK if self._running else _IDLE_LOOK)
            except StoreUnavailable as error:
                log.warning("jobs wait for the store: %s", error.detail)
                pause = self._held_up(pause)
            except Exception as error:
                log.error("jobs wait after a fault", exc_info=error)
                pause = self._held_up(pause)
        self._end()

    def _held_up(self, pause: float) -> float:
        """Wait after a failure; the next wait."""
        if self._leading and time.monotonic() >= self._until:
            self._abandon()
        self._stopping.wait(pause)
        return min(2.0 * pause, _LONGEST_BACK_OFF)

    def _step(self) -> None:
        if not self._leads():
            return
        self._settle()
        self._stop_cancelled()
        self._claim()
        self._dispatch()

    def _leads(self) -> bool:
        """Whether this is the one runner, asking again in time."""
        now = time.monotonic()
        if now < self._renew_at:
            return self._leading
        got = self._jobs.lease(ROLE, self._holder, self._lease)
        if got != "kept":
            self._abandon()
        if got is not None:
            # Not only at the beginning: a change may be on the disk although the store did not say so.
            self._jobs.requeue(set(self._running))
        self._leading = got is not None
        self._until = now + self._lease
        self._renew_at = now + self._lease / (3.0 if self._leading else 10.0)
        return self._leading

    def _settle(self) -> None:
        """Bring what the workers have done to the store; what the store refuses stays for the next time."""
        while self._landed:
            job, number, future = self._landed[0].job, self._landed[0].number, self._landed[0].future
            if job.flying.get(number) is future:
                if future.cancelled():
                    self._restart_workers()
                    raise ConnectionError("the workers are gone, and their tasks with them")
                try:
                    self._settle_one(job, number, future)
                except StoreUnavailable:
                    raise
                except Exception as error:
                    self._fail(job, _fault(job.job, error))
                job.flying.pop(number, None)
            self._landed.popleft()

    def _settle_one(self, job: RunningJob, number: int, future: Future[bytes]) -> None:
        if future.exception() is not None:
            log.warning("a worker was lost at a task of job %s", job.job.id)
            if not job.lost(number):
                detail = "the workers of one of its tasks ended, time after time, before the task did"
                self._fail(job, problem(500, "worker_lost", "Workers were lost", detail))
            return
        outcome = Outcome.from_bytes(future.result())
        if outcome.version != code_version():
            detail = f"a worker runs the code {outcome.version}, this server {code_version()}"
            self._fail(job, problem(500, "other_code", "A worker runs other code", detail))
        elif outcome.problem is not None:
            self._fail(job, outcome.problem)
        elif job.is_last(number):
            finished = job.kind.keep(job.job, outcome.result, self._store)
            self._jobs.finish(job.job.id, job.job.attempts, finished.path, finished.content)
            # Where it was asked to stop meanwhile, it is about to be.
            self._jobs.cancelled(job.job.id, job.job.attempts)
            self._drop(job)
        elif self._jobs.record(job.job.id, job.job.attempts, number, future.result()):
            job.done(number, outcome.result)
        else:
            self._drop(job)

    def _fail(self, job: RunningJob, document: dict[str, object]) -> None:
        self._jobs.fail(job.job.id, job.job.attempts, orjson.dumps(document).decode())
        self._jobs.cancelled(job.job.id, job.job.attempts)
        self._drop(job)

    def _stop_cancelled(self) -> None:
        if self._running:
            for ident in self._jobs.cancelling() & set(self._running):
                job = self._running[ident]
                self._drop(job)
                self._jobs.cancelled(ident, job.job.attempts)

    def _claim(self) -> None:
        """Take up jobs: one of every owner, and more of one while workers would stand idle."""
        while len(self._running) < self._most_running:
            served = {job.job.owner for job in self._running.values()}
            waiting = self._jobs.waiting()
            self._claims.keep({*waiting, *served})
            idle = not any(job.waiting for job in self._running.values()) and self._free() > 0
            candidates = [owner for owner in waiting if idle or owner not in served]
            if not candidates:
                return
            claimed = self._jobs.claim(self._claims.take(candidates))
            if claimed is not None:
                self._open(*claimed)

    def _open(self, job: Job, spec: bytes) -> None:
        try:
            self._running[job.id] = RunningJob(job, spec, self._jobs.chunks(job.id), code_version())
        except StoreUnavailable:
            raise
        except Exception as error:
            self._jobs.fail(job.id, job.attempts, orjson.dumps(_fault(job, error)).decode())

    def _dispatch(self) -> None:
        """Give waiting tasks to free workers, one owner after the other."""
        while any(job.waiting for job in self._running.values()):
            if self._executor is None:
                self._executor = self._start_workers()
            if self._free() <= 0:
                return
            able = [job for job in self._running.values() if job.waiting]
            self._dispatches.keep({job.job.owner for job in self._running.values()})
            owner = self._dispatches.take([job.job.owner for job in able])
            job = min((one for one in able if one.job.owner == owner), key=lambda one: len(one.flying))
            number, task = job.next_task()
            try:
                future = self._executor.submit(task)
            except BaseException:
                job.back(number)
                self._restart_workers()
                raise
            job.flying[number] = future
            future.add_done_callback(partial(self._land, job, number))

    def _restart_workers(self) -> None:
        """Have other workers next time; tasks that these were at wait again."""
        for job in self._running.values():
            flying, job.flying = job.flying, {}
            for number in flying:
                job.back(number)
        executor, self._executor = self._executor, None
        if executor is not None:
            executor.close()

    def _free(self) -> int:
        """Workers that have nothing to do; one where there are none yet."""
        if self._executor is None:
            return 1
        return self._executor.capacity() - sum(len(job.flying) for job in self._running.values())

    def _land(self, job: RunningJob, number: int, future: Future[bytes]) -> None:
        self._landed.append(_Landed(job, number, future))
        self._wake.set()

    def _drop(self, job: RunningJob) -> None:
        """Stop working on a job, whatever the store says about it."""
        flying, job.flying = job.flying, {}
        for future in flying.values():
            if self._executor is not None and not future.done():
                self._executor.cancel(future)
        self._running.pop(job.job.id, None)

    def _abandon(self) -> None:
        """Stop working on all jobs: another process has them now, or will."""
        self._leading = False
        for job in list(self._running.values()):
            self._drop(job)

    def _end(self) -> None:
        parked = list(self._running.values())
        self._abandon()
        if self._executor is not None:
            self._executor.close()
        try:
            for job in parked:
                if not self._jobs.park(job.job.id, job.job.attempts):
                    self._jobs.cancelled(job.job.id, job.job.attempts)
            self._jobs.release(ROLE, self._holder)
        except StoreUnavailable as error:
            log.warning("jobs are left as they are: %s", error.detail)


def _fault(job: Job, error: Exception) -> dict[str, object]:
    """The problem of a job that failed by our fault, whose traceback goes to the log."""
    log.error("job %s failed", job.id, exc_info=error)
    detail = "the server failed on this job; the failure is in its log"
    return problem(500, "internal_error", "Internal error", detail)
