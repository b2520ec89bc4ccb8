"""Answers about loops that are flown away from their design, and how they compare with the domain's figures."""

from __future__ import annotations

from typing import Any

import numpy as np
from fastapi.testclient import TestClient

from schedules.designed import DesignedEnvelope
from schedules.run import run
from service.examples import example
from service.schemas.requests import DesignRequest
from service.to_domain.study_of import study

#: Field on the wire -> figure of the domain, and one of it in units of the wire.
FIGURES = {
    "damping_ratio": ("damping_ratio", 1.0),
    "largest_real_part": ("largest_real_part", 1.0),
    "settling_time_s": ("settling_time", 1.0),
    "overshoot_percent": ("overshoot", 100.0),
    "gain_margin_db": ("gain_margin", 1.0),
    "phase_margin_deg": ("phase_margin", 180.0 / np.pi),
    "delay_margin_s": ("delay_margin", 1.0),
    "disk_margin": ("disk_margin", 1.0),
}
MARGINS = tuple(FIGURES)[4:]


def posted(client: TestClient, request: dict[str, Any]) -> dict[str, Any]:
    response = client.post("/v1/designs", json=request)
    assert response.status_code in (200, 201), response.text
    document: dict[str, Any] = response.json()
    return document


def address(design: dict[str, Any], name: str, what: str) -> str:
    return f"/v1/designs/{design['id']}/controllers/{name}/{what}"


def answered(client: TestClient, design: dict[str, Any], name: str, what: str) -> dict[str, Any]:
    response = client.get(address(design, name, what))
    assert response.status_code == 200, response.text
    document: dict[str, Any] = response.json()
    return document


def numbers(values: Any) -> Any:
    """Nested lists with null as nan."""
    return np.array(values, dtype=float)


def shown(values: Any) -> Any:
    """Values as the wire shows them: what is not finite is null."""
    return np.where(np.isfinite(values), values, np.nan)


def exactly(got: Any, wanted: Any) -> None:
    np.testing.assert_allclose(numbers(got), shown(wanted), rtol=1e-12, atol=0.0)


def least_damping(client: TestClient, request: dict[str, Any]) -> float:
    """Of the first controller of a design of one point, by its poles."""
    document = posted(client, request)
    found = client.get(f"/v1/designs/{document['id']}/points/0").json()["controllers"][0]["poles"]
    poles = np.array([complex(p["re"], p["im"]) for p in found])
    return float(np.min(-poles.real / np.abs(poles)))


def wind_tunnel() -> DesignedEnvelope:
    """The example `wind_tunnel`, designed without HTTP."""
    return run(study(DesignRequest.model_validate(example("wind_tunnel"))))


def at_one_point(wanted: dict[str, Any]) -> dict[str, Any]:
    """The request with a grid of one point."""
    return wanted | {"grid": {"altitude_m": [0.0], "dynamic_pressure_pa": [980.0]}}
