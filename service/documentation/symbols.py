"""The symbols of the field as names on the wire, and what they mean; names made of words need none of this."""

from __future__ import annotations

import re
from typing import Any

from service.wire.units import without_unit

#: Words of one or two letters that are words, and no symbols.
_WORDS = frozenset({"at", "by", "id", "in", "is", "of", "on", "or", "to", "up", "no"})
_BY = {
    "alpha": "its derivative by the angle of attack, per rad",
    "da": "its derivative by the aileron's deflection, per rad",
    "dt": "its derivative by the tab's deflection, per rad",
    "0": "at angles of zero",
    "disagreement": "how far two rows of the same angles disagree",
}
_SURFACES = {"C_Ha": "aileron", "C_Ht": "tab"}

#: Name of a field -> what it holds.
SYMBOLS = {
    "A": "State matrix of dx/dt = A x + B u + d, rows and columns in the order of `states`",
    "B": "Input matrix of dx/dt = A x + B u + d, columns in the order of `inputs`",
    "C": "Output matrix of y = C x + D u, rows in the order of `outputs`",
    "D": "Feed-through matrix of y = C x + D u",
    "T_a_n_m": "Torque about the aileron's hinge",
    "T_t_n_m": "Torque about the tab's hinge",
    "re": "Real part",
    "im": "Imaginary part",
    "db": "20 log10 of the ratio",
    "dc_gain": "Gain at frequency zero",
    "omega_n": "Exponent of the natural frequency",
    "omega_n_rad_s": "Natural frequency",
    "closed_by_omega_n": "Closed-loop poles divided by the natural frequency",
    "open_by_omega_n": "Open-loop poles divided by the natural frequency",
    "h2": "H2 norm: root mean square of the response to white noise of unit intensity",
    "h2_unit": "Unit of the H2 norm",
    "h2_reason": "Why there is no H2 norm; null where there is one",
    "h_infinity": "H-infinity norm: the largest gain at any frequency and in any direction",
    "h_infinity_reason": "Why there is no H-infinity norm; null where there is one",
    "largest_nu_gap": "Largest distance between the two plants in the gap metric: 0 to 1",
    "one_at_a_time": "Margins of each loop with the other as it is",
    "p05": "Value that 5 % of the cases stay below",
    "p50": "Value that half of the cases stay below",
    "p95": "Value that 95 % of the cases stay below",
    **{name: f"Hinge-moment coefficient of the {surface}" for name, surface in _SURFACES.items()},
    **{
        f"{name}_{by}": f"Hinge-moment coefficient of the {surface}: {words}"
        for name, surface in _SURFACES.items()
        for by, words in _BY.items()
    },
}


def is_symbol(field: str) -> bool:
    """Whether a name holds a symbol: a part with a capital or a digit, or of one or two letters that are no word."""
    parts = [part for part in without_unit(field).split("_") if part]
    return any(re.search("[A-Z0-9]", part) or (len(part) <= 2 and part not in _WORDS) for part in parts)


def describe_symbols(schema: dict[str, Any]) -> None:
    """Describe the properties of an object's JSON schema whose names are symbols, where the model does not."""
    for name, node in schema.get("properties", {}).items():
        if name in SYMBOLS:
            node.setdefault("description", SYMBOLS[name])
