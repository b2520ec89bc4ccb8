"""What a kind of jobs is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from service.store.jobs import Job
from service.store.store import Store

#: A JSON document.
Document = dict[str, Any]


class TaskFailed(Exception):
    """The task ends with this problem document, and its job with it."""

    def __init__(self, problem: Document) -> None:
        super().__init__(problem.get("detail"))
        self.problem = problem


@dataclass(frozen=True)
class Finished:
    """What a job is finished with: the path of its result, and the bytes where these are kept with the job."""

    path: str
    content: bytes | None


class Kind(Protocol):
    """One kind of jobs: tasks in any order, then a last one that has their results.

    Results depend on the spec alone, whoever computes them, in whichever order, after however many restarts.
    """

    def plan(self, spec: Document) -> list[Document]:
        """The tasks before the last one."""

    def last(self, spec: Document, results: Sequence[bytes], created_at: float) -> Document:
        """The last task, by the results of the others in the order of the plan, and when the job was created."""

    def work(self, task: Document) -> bytes:
        """The result of a task, in a worker that has nothing but the task.

        Raises
        ------
        TaskFailed, Refusal : there is none
        """

    def keep(self, job: Job, result: bytes, store: Store) -> Finished:
        """Keep the result of the last task."""
