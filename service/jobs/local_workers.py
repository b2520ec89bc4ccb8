"""Worker processes of this machine, each of which can be killed without harm to the others."""

from __future__ import annotations

import multiprocessing
import os
import signal
from concurrent.futures import CancelledError, Future, ThreadPoolExecutor
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from threading import Lock, Thread
from typing import Any

#: What the server that workers are forked from imports once, in this order.
_PRELOADED = ["service.jobs.one_thread", "service.jobs.worker", "service.app"]


class WorkerLost(Exception):
    """The worker ended before the task did."""


class LocalWorkers:
    """At most `count` processes, started when there is work for them, forked from a server that holds numpy ready."""

    def __init__(self, count: int) -> None:
        self._count = count
        self._context = multiprocessing.get_context("forkserver")
        self._context.set_forkserver_preload(_PRELOADED)
        self._threads = ThreadPoolExecutor(count, thread_name_prefix="job-worker")
        self._idle: list[_Worker] = []
        self._places: dict[Future[bytes], _Place] = {}
        self._lock = Lock()

    def capacity(self) -> int:
        """As many tasks as workers: what is not submitted can be taken in another order."""
        return self._count

    def submit(self, task: bytes) -> Future[bytes]:
        """Have a task worked on.

        Its future raises `WorkerLost` when the worker dies, be it of a `cancel`.
        """
        place = _Place()
        future = self._threads.submit(self._run, task, place)
        with self._lock:
            self._places[future] = place
        future.add_done_callback(self._leave)
        return future

    def cancel(self, future: Future[bytes]) -> None:
        """Drop a task; the worker that is at it is killed."""
        if future.cancel():
            return
        with self._lock:
            place = self._places.get(future)
            if place is not None:
                place.dropped = True
                if place.worker is not None:
                    place.killed = True
                    place.worker.kill()

    def close(self) -> None:
        """Kill all workers, and wait until they are gone."""
        with self._lock:
            futures = list(self._places)
        for future in futures:
            self.cancel(future)
        self._threads.shutdown()
        for worker in self._idle:
            worker.kill()
            worker.bury()
        self._idle.clear()

    def _leave(self, future: Future[bytes]) -> None:
        with self._lock:
            self._places.pop(future, None)

    def _run(self, task: bytes, place: _Place) -> bytes:
        with self._lock:
            worker = self._idle.pop() if self._idle else None
        if worker is None:
            worker = _Worker(self._context)
        with self._lock:
            place.worker = worker
            dropped = place.dropped
        answered = dropped
        try:
            if dropped:
                raise CancelledError
            result = worker.ask(task)
            answered = True
        except (EOFError, OSError) as error:
            raise WorkerLost("the worker ended before the task did") from error
        finally:
            self._leave_worker(place, worker, answered)
        return result

    def _leave_worker(self, place: _Place, worker: _Worker, answered: bool) -> None:
        """A worker that answered, and is not about to be killed, waits for the next task."""
        with self._lock:
            place.worker = None
            sound = answered and not place.killed
            if sound:
                self._idle.append(worker)
        if not sound:
            worker.kill()
            worker.bury()


class _Worker:
    """A process that answers one task after the other through a pipe."""

    def __init__(self, context: Any) -> None:
        self._connection, there = multiprocessing.Pipe()
        try:
            self._process = context.Process(target=_serve, args=(there,), daemon=True)
            self._process.start()
        except BaseException:
            self._connection.close()
            raise
        finally:
            there.close()

    def ask(self, task: bytes) -> bytes:
        self._connection.send_bytes(task)
        return self._connection.recv_bytes()

    def kill(self) -> None:
        self._process.kill()

    def bury(self) -> None:
        self._process.join()
        self._process.close()
        self._connection.close()


@dataclass(eq=False)
class _Place:
    """Where a submitted task is: dropped before it began, with a worker, or with one that is killed for it."""

    worker: _Worker | None = None
    dropped: bool = False
    killed: bool = False


def _serve(tasks: Connection) -> None:
    """The life of a worker: until the pipe closes, or the process that asked for it is gone."""
    from model.memory import keep_freed_memory
    from service.jobs.worker import work

    # An interrupt at the keyboard reaches every process of the group; the server tells its workers to stop.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    keep_freed_memory()
    Thread(target=_end_with_the_parent, daemon=True).start()
    while True:
        try:
            task = tasks.recv_bytes()
        except (EOFError, OSError):
            return
        tasks.send_bytes(work(task))


def _end_with_the_parent() -> None:
    """A server that is killed leaves no worker behind that goes on for nobody."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)
