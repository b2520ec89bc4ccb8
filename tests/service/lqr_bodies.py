"""Requests of one regulator at one point, and the weights, actuators and measurements they are made of."""

from __future__ import annotations

import copy
from typing import Any

from pydantic import ValidationError

from service.examples import example
from service.schemas.requests import DesignRequest

BRYSON: dict[str, Any] = example("wind_tunnel")["controllers"][2]["weights"]
WITH_TAB = BRYSON | {"tab_integral_deg_s": 0.5}
KALMAN = {
    "kind": "kalman",
    "tab_torque_noise": 0.002,
    "aileron_torque_noise": 0.01,
    "tab_angle_noise_deg": 0.001,
    "aileron_angle_noise_deg": 0.002,
}


def eye(n: int) -> list[list[float]]:
    return [[float(i == j) for j in range(n)] for i in range(n)]


EXPLICIT = {"rule": "explicit", "Q": eye(5), "R": eye(2)}
OUTPUT = {"rule": "output", "outputs": ["da_error", "int_a"], "W_y": eye(2), "W_u": eye(2)}
BALANCED = {"rule": "power", "form": "balanced", "base": BRYSON, "tab_power_w": 1.2}
NET_WORK = {"rule": "power", "form": "net_work", "base": BRYSON, "tab_price": 0.5}
LAGS: Any = {"torque_loop_bandwidth_hz": 50.0}
DELAY: Any = {"delay_s": 0.004}


def asked(fields: Any, tab: Any = None, aileron: Any = None, **parts: Any) -> Any:
    """The example's design at one point by one regulator with these fields, and actuators."""
    document = example("wind_tunnel") | parts
    document["grid"] = {"altitude_m": [0.0], "dynamic_pressure_pa": [980.0]}
    document["actuators"]["tab"] |= tab or {}
    document["actuators"]["aileron"] |= aileron or {}
    document["controllers"] = [{"name": "lqr", "kind": "lqr", "weights": BRYSON} | fields]
    return document


def at(document: Any, pointer: str, value: Any) -> Any:
    """The document with a value put at a pointer."""
    changed = copy.deepcopy(document)
    *parents, last = pointer.split("/")[1:]
    place = changed
    for part in parents:
        place = place[int(part) if isinstance(place, list) else part]
    place[int(last) if isinstance(place, list) else last] = value
    return changed


def taken(document: Any) -> bool:
    try:
        DesignRequest.model_validate(document)
    except ValidationError:
        return False
    return True
