"""A client of the HTTP API: designs, studies, schedules and jobs, without writing a request by hand.

>>> with Client("http://127.0.0.1:8000") as gainfield:  # doctest: +SKIP
...     design = gainfield.design(gainfield.example("wind_tunnel"))
...     locus = gainfield.study(design, "nf", "root-locus", point=3)
...     gainfield.save_schedule(design, "nf", "nf.mat")
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any, Self
from uuid import uuid4

import httpx2

#: A JSON object, as answered.
Document = dict[str, Any]

#: States of a job that change no more.
ENDED = ("succeeded", "failed", "cancelled")
#: How often a busy or unwell server is asked again, and how long it is waited for at most [s].
TRIES, LONGEST_PAUSE = 5, 30.0
#: Between two looks at a job, at first and at last [s].
FIRST_LOOK, LAST_LOOK = 0.1, 2.0


class Problem(Exception):
    """What the server answered instead (RFC 9457).

    Attributes
    ----------
    status : of HTTP
    code : name of the kind of problem
    detail : what is wrong, in words
    errors : the fields it is about: pointer, detail, unit, allowed
    """

    def __init__(self, document: Mapping[str, Any]) -> None:
        self.status = int(document.get("status", 0))
        self.code = str(document.get("code", "unknown"))
        self.detail = str(document.get("detail", ""))
        self.errors: list[Document] = list(document.get("errors", ()))
        fields = "".join(
            f"\n  {field['pointer']}: {field['detail']}"
            + (f" (allowed: {field['allowed']})" if field["allowed"] else "")
            for field in self.errors
        )
        super().__init__(f"{self.status} {self.code}: {self.detail}{fields}")


class JobEnded(Exception):
    """A job that was waited for was cancelled, or failed without a problem of its own."""


@dataclass(frozen=True)
class Job:
    """Work that the server does in the background.

    Attributes
    ----------
    state : ``queued``, ``running``, ``cancelling``, ``cancelled``, ``failed`` or ``succeeded``
    done, total : pieces of the work
    result : address of the result; None until it succeeded
    document : everything that was answered about it
    """

    id: str
    state: str
    done: int
    total: int
    result: str | None
    document: Document

    @classmethod
    def of(cls, document: Document) -> Job:
        """The job that a document is about."""
        progress = document["progress"]
        return cls(document["id"], document["state"], progress["done"], progress["total"], document["result"], document)

    @property
    def ended(self) -> bool:
        """Whether its state changes no more."""
        return self.state in ENDED


Progress = Callable[[Job], None]


class Client:
    """A connection to one server; to be closed, or used as a context manager. One thread at a time.

    A design or a job may be given by its document or by its id. Work that the server does in the background is waited
    for, and `progress` called with the job meanwhile. Posts carry a key of their own, so that one that is sent again
    after a lost connection is not done twice.

    Parameters
    ----------
    address : of the server
    key : API key, where the server wants one
    timeout : of one answer [s]
    http : a client of httpx2 that is made already, for tests; `address`, `key` and `timeout` are its own then

    Raises
    ------
    Problem : from every method, when the server refuses
    httpx2.HTTPError : from every method, when the server cannot be reached
    """

    def __init__(
        self,
        address: str = "http://127.0.0.1:8000",
        key: str | None = None,
        timeout: float = 60.0,
        http: httpx2.Client | None = None,
    ) -> None:
        headers = {} if key is None else {"Authorization": f"Bearer {key}"}
        self._http = http or httpx2.Client(base_url=address, headers=headers, timeout=timeout)

    def __enter__(self) -> Self:
        """The client itself."""
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        """Close the connection."""
        self.close()

    def close(self) -> None:
        """Close the connection."""
        self._http.close()

    # What the server has.

    def version(self) -> Document:
        """Release and code of the server."""
        return self.get("/v1/version")

    def limits(self) -> dict[str, Document]:
        """What the server takes, by name."""
        return {limit["name"]: limit for limit in self.get("/v1/limits")["limits"]}

    def example(self, name: str) -> Document:
        """A shipped request, to be changed and posted."""
        document: Document = self.get("/v1/examples")[name]
        return document

    # Designs.

    def design(self, request: Document, progress: Progress | None = None) -> Document:
        """Design every controller of a request over its grid; the design, as answered."""
        return self.post("/v1/designs", request, progress=progress)

    def start_design(self, request: Document) -> Job | Document:
        """The same in the background: the job, or the design when the server has it already."""
        answer = self._send("POST", "/v1/designs", json=request, headers={"Prefer": "respond-async"})
        return Job.of(answer.json()) if answer.status_code == 202 else answer.json()

    def read_design(self, ident: str) -> Document:
        """A design by its id."""
        return self.get(f"/v1/designs/{ident}")

    def designs(self) -> Iterator[Document]:
        """All designs in the list, newest first."""
        return self._items("/v1/designs")

    def delete_design(self, design: Document | str) -> None:
        """Let go of a design."""
        self._send("DELETE", f"/v1/designs/{_id(design)}")

    def point(self, design: Document | str, index: int) -> Document:
        """Plant and controllers at a flat row-major grid point."""
        return self.get(f"/v1/designs/{_id(design)}/points/{index}")

    def study(
        self,
        design: Document | str,
        controller: str | None,
        name: str,
        body: Document | None = None,
        progress: Progress | None = None,
        **parameters: Any,
    ) -> Document:
        """A study of a design, or of one of its controllers, by the last part of its route.

        Parameters
        ----------
        controller : its name; None for studies of the design, as ``verification`` or ``cross-check``
        name : of the study: ``root-locus``, ``response``, ``actuator-requirements``, ``weight-search``, ...
        body : what is posted; None: the study is asked for by a GET
        parameters : of the query (``from_`` is ``from``)
        """
        of = "" if controller is None else f"/controllers/{controller}"
        path = f"/v1/designs/{_id(design)}{of}/{name}"
        query = {key.rstrip("_"): value for key, value in parameters.items()}
        return self.get(path, progress, **query) if body is None else self.post(path, body, progress, **query)

    # Schedules.

    def schedule(self, design: Document | str, controller: str, suffix: str, **rules: str) -> bytes:
        """The gain-schedule file of a controller: ``json csv mat npz h c m xml dml h5``."""
        path = f"/v1/designs/{_id(design)}/schedules/{controller}.{suffix}"
        return self._settled(self._send("GET", path, params=rules), None).content

    def save_schedule(self, design: Document | str, controller: str, path: str | Path, **rules: str) -> Path:
        """The same, saved under a name that ends in the format's suffix."""
        path = Path(path)
        path.write_bytes(self.schedule(design, controller, path.suffix.removeprefix("."), **rules))
        return path

    def verify_schedule(self, document: Document, progress: Progress | None = None) -> Document:
        """The proof between the points of an uploaded table."""
        return self.post("/v1/schedules/verify", document, progress)

    # Jobs.

    def jobs(self) -> Iterator[Job]:
        """All jobs in the list, newest first."""
        return map(Job.of, self._items("/v1/jobs"))

    def job(self, job: Job | str) -> Job:
        """The job as it stands now."""
        return Job.of(self.get(f"/v1/jobs/{_id(job)}"))

    def cancel(self, job: Job | str) -> None:
        """Stop a job; forget it when it has ended."""
        self._send("DELETE", f"/v1/jobs/{_id(job)}")

    def wait(self, job: Job | str, progress: Progress | None = None) -> Document:
        """The result of a job, once it ended.

        Raises
        ------
        Problem : the job failed
        JobEnded : it was cancelled
        """
        document: Document = self._result(job, progress).json()
        return document

    # Any route.

    def get(self, path: str, progress: Progress | None = None, **query: Any) -> Document:
        """The JSON at a path."""
        return self._document(self._send("GET", path, params=query), progress)

    def post(self, path: str, body: Document, progress: Progress | None = None, **query: Any) -> Document:
        """The JSON that is answered to a JSON body."""
        headers = {"Idempotency-Key": uuid4().hex}
        return self._document(self._send("POST", path, json=body, params=query, headers=headers), progress)

    def _document(self, answer: httpx2.Response, progress: Progress | None) -> Document:
        document: Document = self._settled(answer, progress).json()
        return document

    def _settled(self, answer: httpx2.Response, progress: Progress | None) -> httpx2.Response:
        """The answer itself, be it given at once or by a job."""
        return self._result(Job.of(answer.json()), progress) if answer.status_code == 202 else answer

    def _result(self, job: Job | str, progress: Progress | None) -> httpx2.Response:
        pause = FIRST_LOOK
        while not (found := self.job(job)).ended:
            if progress is not None:
                progress(found)
            time.sleep(pause)
            pause = min(1.5 * pause, LAST_LOOK)
        if progress is not None:
            progress(found)
        if found.result is not None:
            return self._send("GET", found.result)
        if found.document["error"] is not None:
            raise Problem(found.document["error"])
        raise JobEnded(f"the job {found.id} {found.state}")

    def _items(self, path: str) -> Iterator[Document]:
        cursor: str | None = None
        while True:
            query: Document = {} if cursor is None else {"cursor": cursor}
            page = self.get(path, **query)
            yield from page["items"]
            cursor = page["next_cursor"]
            if cursor is None:
                return

    def _send(self, method: str, path: str, **what: Any) -> httpx2.Response:
        """The answer; a server that is busy is asked again, as late as it wants to be."""
        for last in [*[False] * (TRIES - 1), True]:
            answer = self._http.request(method, path, **what)
            if answer.is_success:
                return answer
            pause = _pause(answer)
            if last or pause is None:
                break
            time.sleep(pause)
        raise Problem(_problem(answer))


def _id(of: Document | Job | str) -> str:
    if isinstance(of, Job):
        return of.id
    return of if isinstance(of, str) else str(of["id"])


def _pause(answer: httpx2.Response) -> float | None:
    """How long the server wants to be left alone [s]; None when asking again would not help."""
    if answer.status_code not in (429, 503):
        return None
    asked = answer.headers.get("retry-after", "")
    return min(float(asked), LONGEST_PAUSE) if asked.isdecimal() else None


def _problem(answer: httpx2.Response) -> Document:
    if answer.headers.get("content-type", "").startswith("application/problem+json"):
        document: Document = answer.json()
        return document
    return {"status": answer.status_code, "code": "not_gainfield", "detail": answer.text[:200]}
