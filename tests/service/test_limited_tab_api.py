"""Limited tabs over HTTP: less tab, more aileron torque (seed Fig 5.19)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from fastapi.testclient import TestClient

from service.app import create_app
from service.examples import example
from service.settings import Settings


def test_less_tab_leaves_more_to_the_aileron(client: TestClient) -> None:
    """With the tab free it is the non-linear requirement; held at next to nothing the aileron takes all of it."""
    design = client.post("/v1/designs", json=example("wind_tunnel")).json()
    here = f"/v1/designs/{design['id']}/controllers/lqr"
    limits = [0.01, 5.0, 10.0, 170.0]
    response = client.get(f"{here}/limited-tab", params={"tab_limit_deg": limits})
    assert response.status_code == 200, response.text
    found = response.json()
    np.testing.assert_allclose(found["tab_limit_deg"], limits)
    peak = np.array(found["points"]["aileron_peak_torque_n_m"])
    tab = np.array(found["points"]["tab_peak_deflection_deg"])
    assert np.all(tab <= np.array(limits) * (1.0 + 1e-6))
    assert np.all(np.array(found["points"]["tab_time_at_limit_s"])[..., 0] > 0.5)
    body = {
        "manoeuvre": {"kind": "step", "aileron_deg": 10.0},
        "duration_s": 1.0,
        "nonlinear": {"limits": False, "tolerance": 1e-4},
    }
    free = client.post(f"{here}/actuator-requirements", json=body).json()["nonlinear"]
    np.testing.assert_allclose(peak[..., -1], free["actuators"]["aileron"]["peak_torque_n_m"], rtol=1e-9)
    rms = np.array(found["points"]["aileron_rms_torque_n_m"])
    assert np.all(rms[..., 0] > rms[..., -1])
    # Held all but still, the tab leaves the torque that holds the aileron: stiffness of the linear model at the end.
    point = client.get(f"/v1/designs/{design['id']}/points/3").json()["linear_model"]
    A, B = np.array(point["A"]), np.array(point["B"])
    at_rest = -np.linalg.solve(B[[1, 3]], A[[1, 3], 2] * np.deg2rad(10.0))[1] + point["input_offset"][1]
    assert 0.8 * abs(at_rest) < rms[0, 3, 0] < 1.3 * abs(at_rest)
    worst = [one["value"] for one in found["envelope"]]
    np.testing.assert_allclose(worst, peak.reshape(-1, len(limits)).max(axis=0))
    assert set(np.ravel(found["simulation"])) == {"completed"}


def test_a_tab_that_alone_steers_does_not_reach_its_reference(client: TestClient) -> None:
    design = client.post("/v1/designs", json=example("wind_tunnel")).json()
    query = f"/v1/designs/{design['id']}/controllers/nf/limited-tab?tab_limit_deg=2&tab_limit_deg=170"
    found = client.get(query).json()
    error = np.array(found["points"]["final_error_deg"])
    assert np.all(error[..., 0] > 1.0)
    assert np.all(np.abs(error[..., 1]) < 0.5)
    peak = np.array(found["points"]["aileron_peak_torque_n_m"])
    np.testing.assert_array_equal(peak[..., 0], peak[..., 1])


def test_bad_requests(client: TestClient, tmp_path: Any, refused: Callable[..., dict[str, Any]]) -> None:
    document = example("wind_tunnel")
    lqr = document["controllers"][2]
    document["controllers"] += [
        lqr | {"name": "coded", "sample_time_s": 0.002},
        lqr | {"name": "regulator", "reference": "none", "weights": {
            "rule": "explicit", "Q": np.diag([33.0, 0.02, 820.0, 0.08]).tolist(), "R": [[4.0, 0.0], [0.0, 0.25]],
        }},
    ]  # fmt: skip
    here = f"/v1/designs/{client.post('/v1/designs', json=document).json()['id']}/controllers"
    for query in ("tab_limit_deg=0", "tab_limit_deg=181", "tab_limit_deg=x", "limit=3"):
        refused(client.get(f"{here}/nf/limited-tab?{query}"), 422)
    for name in ("coded", "regulator"):
        assert refused(client.get(f"{here}/{name}/limited-tab"), 409)["code"] == "study_not_possible"
    with TestClient(create_app(Settings(data_dir=tmp_path, max_simulated_steps=1000))) as small:
        ident = small.post("/v1/designs", json=example("wind_tunnel")).json()["id"]
        problem = refused(small.get(f"/v1/designs/{ident}/controllers/nf/limited-tab"), 422)
        assert (problem["code"], problem["errors"][0]["pointer"]) == ("limit_exceeded", "/tab_limit_deg")
