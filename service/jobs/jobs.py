"""The jobs of one server: asked for, looked up, cancelled; and the runner that works on them."""

from __future__ import annotations

from functools import partial

from service.jobs.dask_cluster import check_address
from service.jobs.executors import executor
from service.jobs.runner import Runner
from service.limits import setting_of
from service.settings import Settings
from service.store.jobs import Job, NewJob
from service.store.store import Store
from service.wire.refusals import FieldRefusal, NotFound, QueueFull

#: How long a client may wait before it asks again for a job, or for room in the queue [s].
RETRY_AFTER = 1


class Jobs:
    """Starts with the app and stops with it.

    Raises
    ------
    ValueError : the settings name a cluster that is not safe to use
    """

    def __init__(self, store: Store, settings: Settings) -> None:
        check_workers(settings)
        self._store = store
        self._most_queued = settings.max_queued_jobs
        start = partial(executor, settings)
        self._runner = Runner(store, start, settings.max_running_jobs, settings.job_lease_s)
        self._runner.start()

    def close(self) -> None:
        """Stop; running jobs wait for the next start, their finished tasks kept."""
        self._runner.stop()

    def ask(self, new: NewJob, owner: str, again: bool) -> Job:
        """Queue this work, or find the job that does it already; `again`: also when one has done it.

        Raises
        ------
        QueueFull
        """
        job = self._store.jobs.add(new, self._most_queued, again, owner)
        if job is None:
            limit = f"the limit max_queued_jobs of this server (setting {setting_of('max_queued_jobs')})"
            detail = f"{self._most_queued} jobs wait, {limit}"
            allowed = f"< {self._most_queued} waiting jobs"
            raise QueueFull(detail, FieldRefusal("", detail, "1", allowed), wait=RETRY_AFTER)
        self._runner.wake()
        return job

    def find(self, ident: str, owner: str | None) -> Job:
        """The job under this id.

        Raises
        ------
        NotFound
        """
        return _there(self._store.jobs.get(ident, owner), ident)

    def page(self, limit: int, before: int | None, owner: str | None) -> list[Job]:
        """Jobs newest first, queued before the one whose `seq` is given."""
        return self._store.jobs.page(limit, before, owner)

    def cancel(self, ident: str, owner: str | None) -> Job:
        """Cancel a job that waits, ask a running one to stop; the job as it is then.

        Raises
        ------
        NotFound
        """
        job = _there(self._store.jobs.ask_to_cancel(ident, owner), ident)
        self._runner.wake()
        return job

    def forget(self, job: Job) -> None:
        """Drop a job that has ended."""
        self._store.jobs.forget(job.id)

    def result(self, job: Job) -> bytes:
        """The bytes that a job was finished with."""
        return self._store.jobs.result(job)


def check_workers(settings: Settings) -> None:
    """Refuse settings that name a cluster that is not safe to use.

    Raises
    ------
    ValueError
    """
    if settings.dask is not None:
        files = (settings.dask_ca_file, settings.dask_cert_file, settings.dask_key_file)
        check_address(settings.dask, None not in files, settings.dask_allow_insecure)


def _there(job: Job | None, ident: str) -> Job:
    if job is None:
        raise NotFound(f"there is no job {ident[:80]!a}")
    return job
