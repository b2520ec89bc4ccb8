"""Where tasks are worked on: bytes in, bytes out, by workers of this machine or of a cluster."""

from __future__ import annotations

from concurrent.futures import Future
from typing import Protocol

from service.settings import Settings


class Executor(Protocol):
    """Workers that run `service.jobs.worker.work`; a future that ends with an exception was lost with its worker."""

    def capacity(self) -> int:
        """How many tasks it is worth having submitted at the same time."""

    def submit(self, task: bytes) -> Future[bytes]:
        """Have a task worked on."""

    def cancel(self, future: Future[bytes]) -> None:
        """Drop a task, waiting or running; what becomes of its future is of no interest any more."""

    def close(self) -> None:
        """Drop all tasks and let the workers go."""


def executor(settings: Settings) -> Executor:
    """The executor that the settings name: a cluster by its address, or processes of this machine.

    Raises
    ------
    OSError : the cluster does not answer
    """
    if settings.dask is None:
        from service.jobs.local_workers import LocalWorkers

        return LocalWorkers(settings.job_workers)
    from service.jobs.dask_cluster import DaskCluster

    return DaskCluster(settings.dask, settings.dask_ca_file, settings.dask_cert_file, settings.dask_key_file)
