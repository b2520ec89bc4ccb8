"""The shipped spec packs over HTTP: the numbers of the domain, in units of the wire, and no claim beyond them."""

from __future__ import annotations

from typing import Any, get_args

import numpy as np
from fastapi.testclient import TestClient

from design.specs import SPEC_PACKS
from service.routes.spec_packs import NOTES
from service.schemas.meta import SpecPacks
from service.schemas.requests import DesignRequest
from service.schemas.specs import PACK_NAMES, PackName
from service.to_domain import study_of
from service.wire.spec_names import SPEC_FIELDS


def test_every_pack_of_the_domain_is_listed(client: TestClient) -> None:
    document = client.get("/v1/spec-packs").json()
    SpecPacks.model_validate(document, strict=True)
    assert tuple(pack["name"] for pack in document["packs"]) == PACK_NAMES == get_args(PackName) == tuple(SPEC_PACKS)
    assert set(NOTES) == set(SPEC_PACKS)
    default, limit_speed = (
        {spec["name"]: (spec["limit"], spec["unit"]) for spec in pack["specs"]} for pack in document["packs"]
    )
    assert default == {
        "gain_margin_db_min": (6.0, "dB"),
        "phase_margin_deg_min": (45.0, "deg"),
        "disk_margin_min": (0.667, "1"),
        "damping_ratio_min": (0.4, "1"),
        "sensitivity_peak_max": (1.78, "1"),
    }
    assert limit_speed == {"gain_margin_db_min": (4.5, "dB"), "phase_margin_deg_min": (30.0, "deg")}
    assert "no claim of compliance" in document["note"]
    (note,) = (pack["note"] for pack in document["packs"] if pack["name"] == "limit_speed")
    assert "unconfirmed" in note
    assert "MIL-F-9490D" in note


def test_a_listed_pack_can_be_brought_as_ones_own(client: TestClient, wanted: Any) -> None:
    """Its specs, posted inline under another name, are judged like the shipped ones."""
    for pack in client.get("/v1/spec-packs").json()["packs"]:
        specs = {spec["name"]: spec["limit"] for spec in pack["specs"]}
        wanted["spec_pack"] = {"name": "copy", "specs": specs}
        brought = study_of.study(DesignRequest.model_validate(wanted)).spec_pack
        limits = {(spec.quantity, spec.sense, spec.source): spec.limit for spec in brought}
        shipped = {(spec.quantity, spec.sense, spec.source): spec.limit for spec in SPEC_PACKS[pack["name"]]}
        assert limits.keys() == shipped.keys()
        for key, limit in limits.items():
            np.testing.assert_allclose(limit, shipped[key], rtol=1e-15)
        assert all(SPEC_FIELDS[name].unit == spec["unit"] for name, spec in zip(specs, pack["specs"], strict=True))


def test_the_listing_is_not_modified(client: TestClient, refused: Any) -> None:
    tag = client.get("/v1/spec-packs").headers["ETag"]
    assert client.get("/v1/spec-packs", headers={"If-None-Match": tag}).status_code == 304
    refused(client.post("/v1/spec-packs", json={}), 405)
    refused(client.get("/v1/spec-packs/default"), 404)
