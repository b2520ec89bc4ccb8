"""Counts for those who watch the server, in the text format of Prometheus.

Requests, latencies and computations are those of one process. With several workers a scrape reaches one of them, which
the label ``worker`` (its process id) tells apart: sum over it. What is stored is the same seen from every worker.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager

from prometheus_client import CollectorRegistry, Counter, Gauge, Histogram, generate_latest
from prometheus_client.core import GaugeMetricFamily
from prometheus_client.registry import Collector

from service.store.figures import Figures
from service.wire.refusals import StoreUnavailable

CONTENT_TYPE = "text/plain; version=0.0.4; charset=utf-8"
_METHODS = frozenset({"GET", "HEAD", "POST", "PUT", "PATCH", "DELETE", "OPTIONS"})
_STATES = ("queued", "running", "cancelling", "cancelled", "failed", "succeeded")
#: Upper edges of the latencies counted [s]: from what is read to what is searched for.
_EDGES = (0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0, 30.0, 120.0)


class Metrics:
    """Counts of one app; nothing is shared between apps of one process."""

    def __init__(self) -> None:
        self._registry = registry = CollectorRegistry()
        worker = str(os.getpid())
        labels = ("worker", "method", "route")
        self._worker = worker
        self._requests = Counter("gainfield_requests", "Requests answered", (*labels, "status"), registry=registry)
        self._seconds = Histogram(
            "gainfield_request_seconds", "Time to the end of the answer", labels, buckets=_EDGES, registry=registry
        )
        self._in_flight = Gauge(
            "gainfield_requests_in_flight", "Requests being answered", ("worker",), registry=registry
        ).labels(worker)
        self._computing = Gauge(
            "gainfield_computations_in_flight",
            "Requests that have a slot for heavy work",
            ("worker",),
            registry=registry,
        ).labels(worker)
        self._waiting = Gauge(
            "gainfield_computations_waiting", "Requests that wait for a slot", ("worker",), registry=registry
        ).labels(worker)

    def began(self) -> None:
        """A request came."""
        self._in_flight.inc()

    def ended(self, method: str, route: str, status: int, seconds: float) -> None:
        """A request was answered; `route` is a template, status 0 that the client saw no answer."""
        method = method if method in _METHODS else "other"
        self._in_flight.dec()
        self._requests.labels(self._worker, method, route, str(status)).inc()
        self._seconds.labels(self._worker, method, route).observe(seconds)

    @contextmanager
    def computing(self) -> Iterator[None]:
        """A request has a slot."""
        self._computing.inc()
        try:
            yield
        finally:
            self._computing.dec()

    def watch_waiting(self, count: Callable[[], int]) -> None:
        """Have the number of those that wait for a slot read when it is asked for."""
        self._waiting.set_function(count)

    def text(self, stored: Callable[[], Figures]) -> bytes:
        """All counts as text, with what is stored; without the latter when the store does not answer."""
        return generate_latest(self._registry) + generate_latest(_Stored(stored))


class _Stored(Collector):
    """What is stored, counted when it is asked for."""

    def __init__(self, stored: Callable[[], Figures]) -> None:
        self._stored = stored

    def collect(self) -> Iterable[GaugeMetricFamily]:
        """One family a figure."""
        up = GaugeMetricFamily("gainfield_store_up", "Whether the store answers")
        try:
            found = self._stored()
        except StoreUnavailable:
            up.add_metric([], 0.0)
            yield up
            return
        up.add_metric([], 1.0)
        designs = GaugeMetricFamily("gainfield_designs", "Designs in the store")
        designs.add_metric([], found.designs)
        size = GaugeMetricFamily("gainfield_design_bytes", "Bytes of the designs in the store")
        size.add_metric([], found.design_bytes)
        jobs = GaugeMetricFamily("gainfield_jobs", "Jobs in the store, by state", labels=["state"])
        for state in dict.fromkeys((*_STATES, *found.jobs)):
            jobs.add_metric([state], found.jobs.get(state, 0))
        yield from (up, designs, size, jobs)
