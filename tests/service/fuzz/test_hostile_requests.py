"""Ids, queries and headers that nobody should send: refused or passed over, and nothing of the inside is told."""

from __future__ import annotations

import random
from collections.abc import Iterator
from urllib.parse import quote

import pytest

from tests.service.fuzz.served import LEAK, PATIENCE, Served, served
from tests.service.openapi_examples import address, operations

IDS = [
    "../..",
    "..%2f..%2fgainfield.db",
    "%2e%2e",
    "%2e%2e%2f%2e%2e%2fetc%2fpasswd",
    "....//",
    "%00",
    "a%00b",
    "%0d%0aX-Injected:%20yes",
    "\u202e",
    "\u0000".encode().decode(),
    "%ff%fe",
    "%c0%ae%c0%ae",
    "%ed%a0%80",
    "%F0%9F%92%A5",
    "a" * 8000,
    "-1",
    "0x10",
    "1e999",
    "NaN",
    "null",
    "None",
    "' OR 1=1 --",
    "{{7*7}}",
    "$(id)",
    "%25s%25n",
    "*",
    "%",
    "~",
    "0" * 32,
    "9" * 5000,
    "\u0663",
    "\u00b2",
]
#: Values of parameters.
VALUES = [
    "",
    " ",
    "nan",
    "NaN",
    "inf",
    "-inf",
    "1e999",
    "-1e999",
    "1e-999",
    "9" * 5000,
    "-" + "9" * 400,
    "0x1",
    "1_000",
    "\u0663",
    "\u00b2",
    "true",
    "null",
    "[]",
    "{}",
    "\x00",
    "a\r\nX: y",
    "\ud7ff",
    "\U0010ffff",
    "a" * 3000,
    "../../etc/passwd",
    "'; DROP TABLE designs; --",
    "%s%n",
    "\u202e",
]


@pytest.fixture(scope="module")
def here(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    with served(tmp_path_factory.mktemp("hostile")) as running:
        yield running


def test_ids(here: Served) -> None:
    """In the place of every part of every path that is a name."""
    draw = random.Random(20_261_123)
    for path, method, operation in operations(here.openapi):
        named = [each for each in operation.get("parameters", []) if each["in"] == "path"]
        for parameter in named:
            kept = operation | {"parameters": [each for each in named if each is not parameter]}
            template, _ = address(path, kept)
            for value in draw.sample(IDS, 8):
                said = value if "%" in value else quote(value, safe="")
                url = template.replace(f"{{{parameter['name']}}}", said)
                problem = here.refuses(method.upper(), url, value[:80], json={} if method == "post" else None)
                assert problem["status"] in (404, 405, 414, 422), (url[:200], problem)


def test_query_values(here: Served) -> None:
    """In the place of every parameter of every GET: refused, or one of the values that it takes."""
    draw = random.Random(20_261_123)
    for path, method, operation in operations(here.openapi):
        if method != "get" or path.endswith("/events"):
            continue
        url, query = address(path, operation)
        for parameter in operation.get("parameters", []):
            if parameter["in"] != "query":
                continue
            for value in draw.sample(VALUES, 3):
                response = here.http.get(url, params=query | {parameter["name"]: value})
                where = (url, parameter["name"], value[:80], response.status_code, response.text[:300])
                assert response.status_code < 500, where
                assert response.elapsed.total_seconds() < PATIENCE, where
                if response.status_code >= 400:
                    assert response.headers["content-type"] == "application/problem+json", where
                    assert not LEAK.search(response.text), where


def test_queries_that_are_none(here: Served) -> None:
    for query in (
        "x=1",
        "limit=1&limit=2",
        "limit=1;cursor=d1",
        "%00=1",
        "limit",
        "=1",
        "&" * 3000 + "limit=x",
        "limit[]=1",
    ):
        response = here.http.get(f"/v1/designs?{query}")
        assert response.status_code in (200, 422), (query[:80], response.text[:200])
        assert not LEAK.search(response.text)
    here.refuses("GET", "/v1/atmosphere?" + "altitude_m=1&" * 4000 + "x=1")
    assert here.http.get("/v1/atmosphere?" + "altitude_m=1&" * 4000).status_code in (200, 422)


HEADERS = [
    ("Accept", b"*/*;q=NaN"),
    ("Accept", b"text/html;q=1e999, */*;q=-inf"),
    ("Accept", b"," * 5000),
    ("Accept", b"\xff/\xfe"),
    ("Accept", b"application/json;" + b"a=b;" * 5000),
    ("Accept-Encoding", b"gzip;q=nan"),
    ("Range", b"bytes=0-0,-1"),
    ("Range", b"bytes=" + b"0-1," * 5000),
    ("If-None-Match", b"W/" * 9000),
    ("If-None-Match", b'"' * 9000),
    ("If-Modified-Since", b"yesterday"),
    ("Last-Event-ID", b"9" * 9000),
    ("Last-Event-ID", b"\xb2"),
    ("Prefer", b"wait=nan;" * 900),
    ("Prefer", b"\xff"),
    ("X-Forwarded-For", b"1.2.3.4, ::1," * 500),
    ("X-Forwarded-Proto", b"javascript"),
    ("Forwarded", b"for=unknown;host=evil"),
    ("X-Forwarded-Host", b"evil.example"),
    ("X-Original-URL", b"/metrics"),
    ("X-HTTP-Method-Override", b"DELETE"),
    ("X-Request-Id", b"a" * 9000),
    ("X-Request-Id", b'"><script>'),
    ("Cookie", b"a=b;" * 2000),
    ("Origin", b"null"),
    ("Referer", b"\xff"),
    ("User-Agent", b"() { :; }; echo"),
    ("Authorization", b"Bearer"),
    ("Authorization", b"Basic " + b"QQ" * 4000),
    ("Authorization", b"Bearer \xff\xfe"),
    ("X-API-Key", b"gf_" + b"a" * 9000),
    ("Content-Type", b"\xff/\xff; charset=\xff"),
    ("Content-Length", b"0"),
    ("Upgrade", b"websocket"),
    ("Upgrade", b"h2c"),
    ("Connection", b"Upgrade, HTTP2-Settings"),
    ("Expect", b"200-ok"),
    ("Trailer", b"X"),
    ("TE", b"trailers"),
    ("Via", b"1.1 a"),
]


@pytest.mark.parametrize(("name", "value"), HEADERS, ids=range(len(HEADERS)))
def test_headers(here: Served, name: str, value: bytes) -> None:
    """They change what is answered in no way but those that are theirs, and are never said again."""
    for path in ("/v1/limits", "/v1/designs", "/v1/jobs", "/nowhere", "/", "/metrics", "/openapi.json"):
        response = here.http.get(path, headers={name: value})
        assert response.status_code in (200, 304, 401, 404, 406), (path, response.status_code, response.text[:300])
        assert not LEAK.search(response.text) or path in ("/", "/openapi.json", "/metrics")
        said = value.decode("latin-1")
        assert said not in str(response.headers) or said == "Bearer" or len(said) < 5, (path, response.headers)
        assert "evil" not in response.text + str(response.headers)
        assert "javascript:" not in str(response.headers)
