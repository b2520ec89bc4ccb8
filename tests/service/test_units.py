"""Units read off names, allowed values in words, and the places of errors."""

from __future__ import annotations

from typing import Any

import pytest

from service.wire.allowed import allowed_by
from service.wire.units import state_units, unit_of


@pytest.mark.parametrize(
    ("name", "unit"),
    [
        ("chord_m", "m"),
        ("airspeed_m_s", "m/s"),
        ("mass_kg", "kg"),
        ("inertia_kg_m2", "kg m^2"),
        ("density_kg_m3", "kg/m^3"),
        ("dynamic_pressure_pa", "Pa"),
        ("dynamic_viscosity_pa_s", "Pa s"),
        ("temperature_k", "K"),
        ("peak_torque_n_m", "N m"),
        ("omega_rad_s", "rad/s"),
        ("servo_bandwidth_hz", "Hz"),
        ("duration_s", "s"),
        ("settling_time_s_max", "s"),
        ("alpha_deg", "deg"),
        ("rate_deg_s", "deg/s"),
        ("phase_margin_deg_min", "deg"),
        ("gain_margin_db_min", "dB"),
        ("overshoot_percent_max", "%"),
        ("power_w", "W"),
        ("energy_out_j", "J"),
        ("mach", "1"),
        ("damping_ratio_min", "1"),
        ("aileron_hinge", "1"),
    ],
)
def test_units_by_name(name: str, unit: str) -> None:
    assert unit_of(name) == unit


def test_schemas_state_units_of_numbers_only() -> None:
    number: dict[str, Any] = {"type": "number"}
    schema: dict[str, Any] = {
        "properties": {
            "chord_m": dict(number),
            "gain": {"anyOf": [{"type": "array", "items": {"type": "array", "items": number}}, {"type": "null"}]},
            "integral_deg_s": number | {"unit": "deg s"},
            "count": {"type": "integer"},
            "name": {"type": "string"},
        }
    }
    state_units(schema)
    units = {name: node.get("unit") for name, node in schema["properties"].items()}
    assert units == {"chord_m": "m", "gain": "1", "integral_deg_s": "deg s", "count": None, "name": None}


@pytest.mark.parametrize(
    ("schema", "words"),
    [
        ({"type": "number", "minimum": 0.001, "exclusiveMaximum": 1}, ">= 0.001 and < 1"),
        ({"type": "number"}, "a number"),
        ({"type": "integer", "minimum": 2}, "an integer >= 2"),
        ({"type": "integer"}, "an integer"),
        ({"enum": ["a", "b"], "type": "string"}, "one of a, b"),
        ({"const": "a", "type": "string"}, "only a"),
        ({"type": "string", "maxLength": 5, "pattern": "^x$"}, "text, at most 5 characters, matching ^x$"),
        ({"type": "array", "minItems": 1}, "a list, at least 1 items"),
        ({"type": "boolean"}, "true or false"),
        ({"type": "null"}, "null"),
        ({"anyOf": [{"type": "number", "minimum": 0}, {"type": "null"}]}, ">= 0, or null"),
        ({"oneOf": [{"type": "number"}, {"$ref": "#/components/schemas/X"}]}, "a number; or only x"),
        ({}, None),
    ],
)
def test_allowed_in_words(schema: dict[str, Any], words: str | None) -> None:
    assert allowed_by(schema, {"components": {"schemas": {"X": {"const": "x"}}}}) == words
