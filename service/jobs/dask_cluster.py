"""Workers of a Dask cluster, by the address of its scheduler."""

from __future__ import annotations

import ipaddress
import time
from concurrent.futures import Future
from importlib import import_module
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

#: How long the scheduler may take to answer [s]: less than a runner's lease.
_PATIENCE = 3.0
#: How long the number of workers is taken to be what it was [s].
_COUNTED = 2.0


class DaskCluster:
    """The workers of one scheduler. What is cancelled while it runs is dropped, not interrupted.

    Parameters
    ----------
    address : of the scheduler
    ca_file, cert_file, key_file : certificates for ``tls://``

    Raises
    ------
    OSError : the scheduler does not answer
    """

    def __init__(self, address: str, ca_file: Path | None, cert_file: Path | None, key_file: Path | None) -> None:
        # Imported where a cluster is asked for: it takes seconds.
        distributed: Any = import_module("distributed")
        security = None
        if address.startswith("tls://"):
            security = distributed.Security(
                require_encryption=True,
                tls_ca_file=_text(ca_file),
                tls_client_cert=_text(cert_file),
                tls_client_key=_text(key_file),
            )
        self._client = distributed.Client(
            address, security=security, timeout=_PATIENCE, set_as_default=False, name="gainfield"
        )
        self._pool = self._client.get_executor(pure=False)
        self._workers, self._counted_at = 0, -_COUNTED

    def capacity(self) -> int:
        """One task for every thread of the cluster, and one more that waits for each."""
        if time.monotonic() - self._counted_at >= _COUNTED:
            threads = self._client.sync(self._client.scheduler.ncores, callback_timeout=_PATIENCE)
            self._workers = sum(threads.values())
            self._counted_at = time.monotonic()
        return 2 * self._workers

    def submit(self, task: bytes) -> Future[bytes]:
        """Have a task worked on; the cluster gives it to another worker when one is lost."""
        from service.jobs.worker import work

        future: Future[bytes] = self._pool.submit(work, task)
        return future

    def cancel(self, future: Future[bytes]) -> None:
        """Drop a task; a worker that is at it ends it for nobody."""
        future.cancel()

    def close(self) -> None:
        """Drop all tasks, and leave the cluster to itself."""
        self._pool.shutdown(wait=False)
        self._client.close(timeout=_PATIENCE)


def check_address(address: str, certificates: bool, allow_insecure: bool) -> None:
    """Refuse a scheduler that anybody on the network could take tasks from, or give code to.

    Dask knows no passwords and unpickles what it gets: it is safe over TLS with certificates, or on this machine alone.

    Raises
    ------
    ValueError
    """
    parts = urlsplit(address)
    if parts.scheme not in ("tcp", "tls") or not parts.hostname or parts.port is None:
        raise ValueError("the address of a Dask scheduler is tcp://host:port or tls://host:port")
    if parts.scheme == "tls" and not certificates:
        raise ValueError("tls:// needs GAINFIELD_DASK_CA_FILE, GAINFIELD_DASK_CERT_FILE and GAINFIELD_DASK_KEY_FILE")
    if parts.scheme == "tcp" and not _loopback(parts.hostname) and not allow_insecure:
        raise ValueError(
            "a Dask scheduler on another machine is reached by tls:// with certificates; over tcp:// anybody there "
            "could run code as this service (GAINFIELD_DASK_ALLOW_INSECURE=true takes the risk)"
        )


def _loopback(host: str) -> bool:
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def _text(path: Path | None) -> str | None:
    return None if path is None else str(path)
