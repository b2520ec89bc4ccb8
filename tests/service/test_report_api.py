"""The report: what the API answers, on one page, with nothing from elsewhere."""

from __future__ import annotations

import re
from html.parser import HTMLParser
from typing import Any

import pytest
from fastapi.testclient import TestClient

from service.report.charts import line_chart
from service.report.html import element
from service.report.quantities import number


class Page(HTMLParser):
    """Tags, attributes and words of a page; refuses tags that do not match."""

    void = ("meta", "br", "hr", "img", "link", "input")

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.attributes: list[tuple[str, str | None]] = []
        self.words: list[str] = []
        self.open: list[str] = []
        self.feed(text)
        assert self.open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.attributes += attrs
        if tag not in self.void:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.words.append(data)

    @property
    def text(self) -> str:
        return re.sub(r"\s+", " ", " ".join(self.words))


def report(client: TestClient, made: dict[str, Any], query: str = "") -> Page:
    answer = client.get(made["links"]["report"] + query)
    assert answer.status_code == 200, answer.text
    assert answer.headers["content-type"].startswith("text/html")
    assert "default-src 'none'" in answer.headers["content-security-policy"]
    assert client.get(made["links"]["report"] + query).content == answer.content
    return Page(answer.text)


def test_holds_what_the_api_answers(client: TestClient, design: dict[str, Any]) -> None:
    page = report(client, design, "?proof=true")
    assert page.tags.count("h1") == 1
    for controller in design["controllers"]:
        for gain in controller["gains"]:
            for row in gain["values"]:
                assert all(number(value) in page.text for value in row)
        for verdict in controller["verdicts"]:
            assert number(verdict["worst_value"]) in page.text
        demand = client.get(design["links"]["actuator_requirements"][controller["name"]]).json()
        for figures in demand["envelope"].values():
            assert all(number(worst["value"]) in page.text for worst in figures.values())
    proved = client.get(design["links"]["verification"]).json()
    for found in proved["controllers"].values():
        assert found["summary"]["words"] in page.text
    for warning in design["warnings"]:
        assert warning["detail"] in page.text
    assert design["id"] in page.text
    assert "Not asked for" not in page.text
    assert "Not asked for" in report(client, design).text


def test_the_worst_is_the_worst(client: TestClient, design: dict[str, Any]) -> None:
    page = report(client, design)
    found = client.get(design["links"]["figures"]["nf"]).json()
    for values, worst in (
        (found["margins"]["tab"]["phase_margin_deg"], min),
        (found["margins"]["tab"]["disk_margin"], min),
        (found["step"]["settling_time_s"], max),
        (found["decay_rate_1_s"], min),
    ):
        assert number(worst(value for row in values for value in row)) in page.text


def test_a_response_that_does_not_settle_is_the_worst(client: TestClient, wanted: dict[str, Any]) -> None:
    """Followed too briefly at the slow points, the step has no settling time there: not the best of the others."""
    wanted["reference"]["duration_s"] = 0.2
    wanted["controllers"] = [
        {"name": "nf", "kind": "negative_feedback", "gains": {"K_d": 0.0534, "K_p": 1.609, "K_i": 55.73}}
    ]
    made = client.post("/v1/designs", json=wanted).json()
    found = client.get(made["links"]["figures"]["nf"]).json()
    flown = [code == "ok" for row in found["outcomes"] for code in row]
    settling = [value for row in found["step"]["settling_time_s"] for value in row]
    assert not all(flown)  # a point without gains has no figure to be the worst
    unsettled = sum(ok and value is None for ok, value in zip(flown, settling, strict=True))
    assert 0 < unsettled < sum(flown)
    page = report(client, made)
    assert f"settling time {found['null_means']['settling_time_s']} " in page.text
    assert (f"and {unsettled - 1} more" in page.text) == (unsettled > 1)


def test_asks_nobody_and_runs_nothing(client: TestClient, design: dict[str, Any]) -> None:
    page = report(client, design)
    assert not {"script", "link", "img", "iframe", "object"} & set(page.tags)
    names = {name for name, _ in page.attributes}
    assert not {"href", "src", "style", "onclick"} & names


def test_names_are_text(client: TestClient, quick: dict[str, Any]) -> None:
    quick["name"] = "<script>alert('&amp;')</script>\u0007 \u00e9"
    made = client.post("/v1/designs", json=quick)
    assert made.status_code == 201
    page = report(client, made.json())
    assert "script" not in page.tags
    assert "<script>alert('&amp;')</script>" in page.text


def test_points_without_gains_and_large_grids(client: TestClient, wanted: dict[str, Any]) -> None:
    wanted["grid"] = {"altitude_m": [0.0], "dynamic_pressure_pa": {"from": 245.0, "to": 9e4, "count": 70}}
    wanted["controllers"] = wanted["controllers"][2:]
    made = client.post("/v1/designs", json=wanted).json()
    codes = [code for row in made["controllers"][0]["outcomes"] for code in row]
    assert {"ok", "outside_model"} <= set(codes)
    page = report(client, made)
    assert f"{codes.count('ok')} of 70 grid points carry gains" in page.text
    assert "outside model" in page.text
    assert "gains, SI and radians" not in page.text  # seventy rows for each controller would fill pages


def test_without_any_gains(client: TestClient, wanted: dict[str, Any]) -> None:
    wanted["grid"] = {"altitude_m": [0.0], "dynamic_pressure_pa": [980.0]}
    specs = {"damping_ratio_min": 0.95, "phase_margin_deg_min": 85.0}
    wanted["controllers"] = [wanted["controllers"][0] | {"specs": specs}]
    page = report(client, client.post("/v1/designs", json=wanted).json(), "?proof=true")
    assert "0 of 1 grid points carry gains" in page.text
    assert "infeasible" in page.text


@pytest.mark.parametrize(
    ("lines", "stretches"),
    [
        ([("a", [1.0, 2.0, 3.0])], 1),
        ([("a", [1.0, 2.0, None])], 1),
        ([("a", [1.0, None, 3.0])], 0),
        ([("a", [None, None, None]), ("b", [0.0, 0.0, 0.0])], 1),
        ([], 0),
    ],
)
def test_charts_leave_gaps(lines: Any, stretches: int) -> None:
    chart = line_chart("t", [0.0, 1.0, 2.0], lines, ("x", "y"))
    assert len(chart.findall("polyline")) == stretches
    numbers = re.findall(r"-?\d+\.\d+", " ".join(one.get("points", "") for one in chart))
    assert all(0.0 <= float(value) <= 300.0 for value in numbers)
    assert len(chart.findall("circle")) == sum(value is not None for _, line in lines for value in line)


def test_text_around_elements() -> None:
    made = element("p", "a", element("b", "c"), "d", "e")
    assert (made.text, made[0].tail) == ("a", "de")
