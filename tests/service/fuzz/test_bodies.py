"""Bodies that nobody should send, to every route that reads one: refused in words, soon, and nothing is told."""

from __future__ import annotations

import gzip
import json
import random
import time
from collections.abc import Iterator
from typing import Any

import pytest

from tests.service.fuzz.served import Served, served

JSON = {"Content-Type": "application/json"}
#: Texts that stand for a value where Python's encoder would write no such thing, or nothing that is a number.
VALUES = {
    "nan": "NaN",
    "infinity": "Infinity",
    "minus infinity": "-Infinity",
    "overflow": "1e999",
    "minus overflow": "-1e999",
    "surrogate": '"\\ud800"',
    "huge integer": "9" * 4000,
    "integer of too many digits": "9" * 10_000,
    "object of a surrogate": '{"\\udfff": 1}',
    "nested": "[" * 60 + "]" * 60,
    "objects": '{"a":' * 30 + "1" + "}" * 30,
    "digits that are none": '{"²": 1, "٣": 1}',
}
NESTED = 100_000
#: Longest answer to a body of a mebibyte, on a machine that is busy with other tests too [s].
LARGE = 3.0


@pytest.fixture(scope="module")
def here(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    with served(tmp_path_factory.mktemp("bodies")) as running:
        yield running


def leaves(document: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Places of all values that hold no others."""
    items = document.items() if isinstance(document, dict) else enumerate(document)
    for key, value in items:
        if isinstance(value, dict | list) and value:
            yield from leaves(value, (*path, key))
        else:
            yield (*path, key)


def with_text(document: Any, path: tuple[Any, ...], text: str) -> bytes:
    """The document as JSON, with this text at a place."""
    changed = json.loads(json.dumps(document))
    place = changed
    for part in path[:-1]:
        place = place[part]
    place[path[-1]] = "<here>"
    return json.dumps(changed).replace('"<here>"', text).encode()


@pytest.mark.parametrize("name", VALUES)
def test_values_that_are_none(here: Served, name: str) -> None:
    """At places drawn from all of each body; every one is refused, and the server says where."""
    draw = random.Random(name)
    for where, query, body in here.posts():
        every = list(leaves(body))
        for path in draw.sample(every, min(6, len(every))):
            content = with_text(body, path, VALUES[name])
            problem = here.refuses("POST", where, (name, path), params=query, content=content, headers=JSON)
            assert problem["status"] in (400, 422), (where, path, problem)


def unreadable(body: bytes) -> dict[str, tuple[bytes, set[int]]]:
    """Bodies made of a good one, and what each may be answered with."""
    text = body.decode()
    return {
        "nothing": (b"", {400, 422}),
        "nested arrays": (b"[" * NESTED, {400}),
        "nested arrays, closed": (b"[" * NESTED + b"]" * NESTED, {400}),
        "nested objects": (b'{"a":' * NESTED + b"1" + b"}" * NESTED, {400}),
        "nested below": (b'{"name":' + b"[" * 900 + b"]" * 900 + b"}", {400}),
        "nested a little more than may be": (b'{"name":' + b"[" * 64 + b"]" * 64 + b"}", {400}),
        "a key twice": (b'{"name": 1, "name": 2,' + body[1:], {400}),
        "UTF-16": (text.encode("utf-16"), {400}),
        "UTF-16 without a mark": (text.encode("utf-16-le"), {400, 422}),
        "UTF-32": (text.encode("utf-32"), {400}),
        "Latin-1": (text.replace('"name": "', '"name": "\u00e9').encode("latin-1") + b"\xe9", {400}),
        "overlong": (b'{"name": "\xc0\xaf"}', {400}),
        "NUL": (body + b"\x00", {400}),
        "two documents": (body + body, {400}),
        "a truncated string": (body[: len(body) // 2], {400}),
        "the last byte missing": (body[:-1], {400}),
        "trailing": (body + b",", {400}),
        "null": (b"null", {422}),
        "true": (b"true", {422}),
        "a number": (b"1e5", {422}),
        "an array": (b"[" + body + b"]", {422}),
        "a string": (json.dumps(text).encode(), {422}),
        "gzip, not declared": (gzip.compress(body), {400}),
        "a form": (b"a=1&b=2", {400}),
        "comments": (b"/* */" + body, {400}),
        "single quotes": (body.replace(b'"', b"'"), {400}),
    }  # fmt: skip


def test_bodies_that_are_none(here: Served) -> None:
    for where, query, body in here.posts():
        for name, (content, statuses) in unreadable(json.dumps(body).encode()).items():
            problem = here.refuses("POST", where, name, params=query, content=content, headers=JSON)
            assert problem["status"] in statuses, (where, name, problem)


@pytest.mark.parametrize("coding", ["gzip", "deflate", "br", "zstd", "gzip, gzip", "identity, gzip", "x-unknown"])
def test_codings_are_not_taken(here: Served, coding: str) -> None:
    """Nothing is unpacked, so that nothing small becomes large."""
    bomb = gzip.compress(gzip.compress(b" " * (100 << 20), 9), 9)
    for where, query, body in here.posts():
        for content in (bomb, gzip.compress(json.dumps(body).encode()), json.dumps(body).encode()):
            sent = JSON | {"Content-Encoding": coding}
            problem = here.refuses("POST", where, coding, params=query, content=content, headers=sent)
            assert problem["status"] == 415, (where, problem)
            assert "Content-Encoding" in problem["detail"]


def test_identity_is_no_coding(here: Served) -> None:
    where, _, body = next(post for post in here.posts() if post[0] == "/v1/hinge-moments")
    for coding in ("identity", "Identity", ""):
        assert here.http.post(where, json=body, headers={"Content-Encoding": coding}).status_code == 200


@pytest.mark.parametrize(
    "kind",
    [
        None,
        "",
        "text/plain",
        "text/json",
        "application/x-www-form-urlencoded",
        "multipart/form-data; boundary=x",
        "application/json, text/plain",
        "application/jsonp",
        "application/",
        "json",
        "a" * 5000,
        "application/json; charset=utf-16",
        "application/json;charset=latin-1",
        'application/json; charset="UTF-7"',
    ],
)
def test_kinds_that_are_not_taken(here: Served, kind: str | None) -> None:
    headers = {} if kind is None else {"Content-Type": kind}
    for where, query, body in here.posts():
        content = json.dumps(body).encode()
        problem = here.refuses("POST", where, kind, params=query, content=content, headers=headers)
        assert problem["status"] == 415, (where, kind, problem)


@pytest.mark.parametrize("kind", ["application/json; charset=utf-8", 'APPLICATION/JSON;Charset="UTF8"'])
def test_utf_8_may_be_said(here: Served, kind: str) -> None:
    where, _, body = next(post for post in here.posts() if post[0] == "/v1/hinge-moments")
    content = b"\xef\xbb\xbf" + json.dumps(body).encode()
    assert here.http.post(where, content=content, headers={"Content-Type": kind}).status_code == 200


def test_a_hundred_megabytes(here: Served) -> None:
    """Declared or in pieces, they are refused, and not kept."""
    before = here.running.memory()
    piece = b" " * (1 << 20)
    for declared in (True, False):
        began = time.perf_counter()
        headers = JSON | ({"Content-Length": str(100 << 20)} if declared else {})
        try:
            response = here.http.post("/v1/designs", content=(piece for _ in range(100)), headers=headers)
        except OSError:  # the server answered and closed while the client was still sending
            continue
        finally:
            assert time.perf_counter() - began < 5.0
        assert response.status_code == 413
    assert here.running.memory() < before + 30.0


def large(good: Any) -> dict[str, bytes]:
    """Bodies of a mebibyte at most, as costly to read, check and refuse as they can be made."""
    controller = good["controllers"][0]
    keys = {f"k{number}": 0 for number in range(900)}
    wrong = [["a"] * 1000] * 200
    specs = {"damping_ratio_min": {"axis": None, "values": wrong}}
    documents = {
        "keys without end": {f"k{number}": 0 for number in range(60_000)},
        "wrong controllers": good | {"controllers": [{"kind": "lqr"}] * 50_000},
        "controllers of wrong keys": good | {"controllers": [controller | keys] * 70},
        "wrong rows": good | {"aerodynamics": {"source": "table", "rows": [["a"] * 5] * 30_000, "fit": None}},
        "wrong numbers over the grid": good | {"controllers": [controller | {"specs": specs}]},
        "wrong breakpoints": good | {"grid": {"altitude_m": ["a"] * 9999, "dynamic_pressure_pa": ["a"] * 9999}},
        "a wrong table": {"schedule": {"gains": [{"name": "K", "unit": "1", "values": wrong}]}},
        "wrong candidates": {"candidates": [{"colour": 1, "size": 2}] * 9000},
    }
    return {name: json.dumps(document).encode() for name, document in documents.items()} | {
        "many numbers": b"[" + b"1e308," * 150_000 + b"1]",
        "long integers": b"[" + b",".join([b"9" * 4000] * 250) + b"]",
        "one long number": b"1" * 1_000_000,
        "one long string": b'"' + b"\\u0041" * 170_000 + b'"',
        "many objects": b"[" + b"{}," * 300_000 + b"{}]",
        "many arrays": b"[" + b"[[[[]]]]," * 110_000 + b"[]]",
    }


@pytest.mark.parametrize("where", ["/v1/designs", "/v1/schedules/verify", "/actuator-selection"])
def test_large_bodies_do_not_hold_up_the_server(here: Served, where: str) -> None:
    """They are read and checked on the one event loop: whatever a body costs, everybody waits for."""
    url, query, _ = next(post for post in here.posts() if post[0].endswith(where))
    _, _, good = next(post for post in here.posts() if post[0] == "/v1/designs")
    for name, content in large(good).items():
        assert len(content) <= 1 << 20, (name, len(content))
        here.refuses("POST", url, name, patience=LARGE, params=query, content=content, headers=JSON)


def test_the_server_is_as_large_as_before(here: Served) -> None:
    """What was refused is not kept: the same again takes no more memory."""
    _, _, good = next(post for post in here.posts() if post[0] == "/v1/designs")

    def refused_bodies() -> None:
        for name in ("wrong rows", "wrong breakpoints", "long integers", "one long string"):
            here.refuses("POST", "/v1/designs", name, content=bodies[name], headers=JSON)

    bodies = large(good)
    for _ in range(3):
        refused_bodies()
    before = here.running.memory()
    for _ in range(5):
        refused_bodies()
    assert here.running.memory() < before + 16.0
