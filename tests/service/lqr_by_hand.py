"""State feedback of a design put together from what the wire says of it, with no code of the domain but the model."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from fastapi.testclient import TestClient

from model.arrays import FloatArray
from schedules.designed import DesignedController, DesignedEnvelope
from schedules.run import run
from service.documentation.design_examples import design_requests
from service.schemas.requests import DesignRequest
from service.to_domain import study_of


@dataclass(frozen=True)
class Posted:
    """A design as answered, and the same run in Python."""

    client: TestClient
    design: dict[str, Any]
    envelope: DesignedEnvelope

    def get(self, name: str, what: str) -> Any:
        return self.client.get(f"/v1/designs/{self.design['id']}/controllers/{name}/{what}")

    def answered(self, name: str, what: str) -> dict[str, Any]:
        response = self.get(name, what)
        assert response.status_code == 200, response.text
        document: dict[str, Any] = response.json()
        assert document["name"] == name
        return document

    def controller(self, name: str) -> DesignedController:
        return self.envelope.controller(name)

    def by_hand(self, name: str, point: int) -> ByHand:
        return by_hand(self.client.get(f"/v1/designs/{self.design['id']}/points/{point}").json(), name)


def posted(client: TestClient, body: dict[str, Any]) -> Posted:
    response = client.post("/v1/designs", json=body)
    assert response.status_code in (200, 201), response.text
    return Posted(client, response.json(), run(study_of.study(DesignRequest.model_validate(body))))


def example(name: str) -> dict[str, Any]:
    return design_requests()[name][1]


@dataclass(frozen=True)
class ByHand:
    """``x' = A x + B u + E r``, ``u = -K x + N r`` over ``dt dt_rate da da_rate``, integrals and torques behind a lag.

    `torques` (2,) are those of the trim.
    """

    A: FloatArray
    B: FloatArray
    E: FloatArray
    K: FloatArray
    N: FloatArray
    states: list[str]
    torques: FloatArray

    @property
    def closed(self) -> FloatArray:
        return self.A - self.B @ self.K

    def loop(self, omega: FloatArray) -> Any:
        """L (W, 2, 2)."""
        n = len(self.A)
        return self.K @ np.linalg.solve(1j * omega[:, None, None] * np.eye(n) - self.A, self.B + 0j)


def by_hand(point: dict[str, Any], name: str, lag: float | None = None) -> ByHand:
    """The loop of a controller with the reference `aileron` or none, from the answer about a point."""
    (controller,) = [c for c in point["controllers"] if c["name"] == name]
    gains = {gain["name"]: gain["value"] for gain in controller["gains"]}
    states = [gain.removeprefix("K_T_t_") for gain in gains if gain.startswith("K_T_t_")]
    plant, n = point["linear_model"], len(states)
    A, B, E = np.zeros((n, n)), np.zeros((n, 2)), np.zeros((n, 1))
    A[:4, :4], B[:4] = plant["A"], plant["B"]
    if "int_a" in states:
        A[states.index("int_a"), 2], E[states.index("int_a"), 0] = -1.0, 1.0
    if lag is not None:
        first = states.index("tab_torque")
        A[:4, first : first + 2], B[:4] = B[:4], 0.0
        A[first : first + 2, first : first + 2], B[first : first + 2] = -lag * np.eye(2), lag * np.eye(2)
    K = np.array([[gains[f"K_{u}_{x}"] for x in states] for u in ("T_t", "T_a")])
    N = np.array([[gains.get(f"N_{u}_r_a", 0.0)] for u in ("T_t", "T_a")])
    return ByHand(A, B, E, K, N, states, np.array([point["trim"]["T_t_n_m"], point["trim"]["T_a_n_m"]]))
