"""A job that is being worked on: which tasks wait, fly, are done; knows neither store nor workers."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Mapping
from concurrent.futures import Future

import orjson

from service.jobs.kinds.kind import Document, Kind
from service.jobs.kinds.kinds import KINDS
from service.jobs.outcome import Outcome
from service.jobs.worker import task_of
from service.store.jobs import Job

#: How often a task whose worker died is given to another before the job fails.
MOST_TRIES = 3


class RunningJob:
    """The tasks of one job, numbered; the last one waits for all others.

    Parameters
    ----------
    spec : what the job is about, as it is stored
    done : outcomes kept of earlier attempts, by number; those of another code's workers are worked out again
    version : this code
    """

    def __init__(self, job: Job, spec: bytes, done: Mapping[int, bytes], version: str) -> None:
        self.job = job
        self.kind: Kind = KINDS[job.kind]
        self._spec: Document = orjson.loads(spec)
        self._tasks = self.kind.plan(self._spec)
        self._results = {number: outcome.result for number, outcome in _usable(done, version)}
        self._waiting = deque(number for number in range(len(self._tasks)) if number not in self._results)
        self._tries: Counter[int] = Counter()
        self._ask_last()
        self.flying: dict[int, Future[bytes]] = {}

    @property
    def waiting(self) -> bool:
        """Whether a task could be given to a worker now."""
        return bool(self._waiting)

    def is_last(self, number: int) -> bool:
        """Whether this task ends the job."""
        return number == len(self._tasks)

    def next_task(self) -> tuple[int, bytes]:
        """Number and bytes of a task that waits, which does not any more."""
        number = self._waiting.popleft()
        if not self.is_last(number):
            return number, task_of(self.job.kind, self._tasks[number])
        results = [self._results[i] for i in range(len(self._tasks))]
        return number, task_of(self.job.kind, self.kind.last(self._spec, results, self.job.created_at))

    def done(self, number: int, result: bytes) -> None:
        """A task before the last one has its result."""
        self._results[number] = result
        self._ask_last()

    def lost(self, number: int) -> bool:
        """The worker of a task died: the task waits again, unless it took too many workers with it (False)."""
        self._tries[number] += 1
        if self._tries[number] >= MOST_TRIES:
            return False
        self.back(number)
        return True

    def back(self, number: int) -> None:
        """A task that was not worked on waits again."""
        self._waiting.appendleft(number)

    def _ask_last(self) -> None:
        if len(self._results) == len(self._tasks):
            self._waiting.append(len(self._tasks))


def _usable(done: Mapping[int, bytes], version: str) -> list[tuple[int, Outcome]]:
    outcomes = [(number, Outcome.from_bytes(content)) for number, content in done.items()]
    return [(number, outcome) for number, outcome in outcomes if outcome.version == version]
