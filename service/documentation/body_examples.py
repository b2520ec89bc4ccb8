"""Bodies of requests, which the documentation shows and which run as they stand."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from service.documentation.design_examples import design_requests
from service.examples import NAMES, example

Examples = dict[str, dict[str, Any]]

#: A small table, linear in the angles: two incidences by three aileron by three tab angles.
ROWS = [
    [
        alpha,
        aileron,
        tab,
        round(-9e-4 * alpha + 1.3e-3 * aileron + 1.8e-3 * tab, 6),
        round(6e-5 * aileron + 1.5e-4 * tab, 6),
    ]
    for alpha in (0.0, 5.0)
    for aileron in (-10.0, 0.0, 10.0)
    for tab in (-10.0, 0.0, 10.0)
]
CSV = "alpha_deg,da_deg,dt_deg,C_Ha,C_Ht\n" + "".join(",".join(f"{x:g}" for x in row) + "\n" for row in ROWS)

DERIVATIVES = {
    "source": "derivatives",
    "C_Ha_0": -0.0014,
    "C_Ha_alpha": -0.0357,
    "C_Ha_da": 0.0683,
    "C_Ha_dt": 0.1005,
    "C_Ht_0": -0.0001,
    "C_Ht_alpha": -0.0021,
    "C_Ht_da": 0.0037,
    "C_Ht_dt": 0.0084,
}
TABLE = {"source": "table", "rows": ROWS, "fit": {"method": "taylor", "order": 2, "window_deg": None}}
MEAN_LINE = [[0.0, 0.0], [0.1, 0.011], [0.25, 0.018], [0.5, 0.0165], [0.75, 0.0095], [1.0, 0.0]]


def plant() -> dict[str, Any]:
    """The plant part of the example `wind_tunnel`."""
    document = example(NAMES[0])
    return {part: document[part] for part in ("geometry", "inertia", "aerodynamics", "atmosphere", "trim", "grid")}


def _designs() -> Examples:
    return {name: _shown(summary, value) for name, (summary, value) in design_requests().items()}


def _hinge_moments() -> Examples:
    wire = {
        "geometry": {"aileron_hinge": 0.7, "tab_hinge": 0.88},
        "aerodynamics": {"source": "thin_aerofoil", "section": "NACA 23012"},
        "states": [{"alpha_deg": 5.0, "aileron_deg": 10.0, "tab_deg": -10.0}],
    }
    csv = {"source": "table", "csv": CSV, "fit": {"method": "cubic"}}
    mean_line = {"source": "thin_aerofoil", "section": MEAN_LINE}
    return {
        "naca_23012": _shown("NACA 23012, hinges at 70 % and 88 %", wire | {"chordwise": [0.25, 0.5]}),
        "mean_line": _shown("a mean line through points", wire | {"aerodynamics": mean_line}),
        "derivatives": _shown("eight given numbers", wire | {"aerodynamics": DERIVATIVES}),
        "table": _shown("rows, expanded to order 2", wire | {"aerodynamics": TABLE}),
        "csv": _shown("rows as CSV, interpolated", wire | {"aerodynamics": csv}),
    }


def _linear_models() -> Examples:
    floating = {"alpha_deg": 2.0, "tab_deg": "zero_aileron_torque"}
    better = plant()["aerodynamics"] | {"damping": "unsteady", "virtual_inertia": True}
    return {
        "wind_tunnel": _shown("wind_tunnel", plant()),
        "table": _shown(
            "from a table, trimmed without aileron torque", plant() | {"aerodynamics": TABLE, "trim": floating}
        ),
        "unsteady": _shown("with the lag of the air: six states", plant() | {"aerodynamics": better}),
    }


def _eigenvalue_sweeps() -> Examples:
    tab_chord = {"quantity": "tab_chord_ratio", "values": {"from": 0.03, "to": 0.47, "count": 12}}
    field = {"pointer": "/inertia/tab/inertia_kg_m2", "values": [1e-4, 2.1e-4, 4e-4]}
    return {
        "airspeed": _shown(
            "over airspeed", plant() | {"vary": {"quantity": "airspeed_m_s", "values": [20.0, 35.0, 50.0]}}
        ),
        "tab_chord": _shown("over the tab's chord (seed Fig 2.13)", plant() | {"vary": tab_chord}),
        "any_field": _shown("over any number of the request", plant() | {"vary": field}),
    }


def _steady_state_maps() -> Examples:
    plane = {"aileron_deg": [-10.0, 0.0, 10.0], "tab_deg": {"from": -20.0, "to": 20.0, "count": 5}}
    limits = {"tab": {"deflection_deg": 25.0, "torque_n_m": 2.0}, "aileron": {"deflection_deg": 25.0}}
    return {"wind_tunnel": _shown("wind_tunnel", plant() | {"deflections": plane, "limits": limits})}


def _similarity() -> Examples:
    measured = {
        "omega_n_rad_s": 77.5,
        "damping_ratio": 0.19,
        "dc_gain": -1.2,
        "chord_m": 0.6,
        "span_m": 0.8,
        "inertia_kg_m2": 0.0055,
        "airspeed_m_s": 50.0,
    }
    airliner = example("airliner_aileron")
    full_size = {part: airliner[part] for part in plant()} | {"measured": measured}
    return {
        "wind_tunnel": _shown("wind_tunnel", plant() | {"tolerance": 0.1}),
        "full_size": _shown("a measured wind-tunnel model scaled to an airliner's aileron", full_size),
    }


def _actuator_selection() -> Examples:
    small = {
        "name": "small",
        "stall_torque_n_m": 0.15,
        "no_load_rate_deg_s": 30000.0,
        "continuous_torque_n_m": 0.05,
        "power_w": 80.0,
        "rotor_inertia_kg_m2": 1e-6,
        "gear_ratio": {"low": 1.0, "high": 60.0},
        "efficiency": 0.9,
    }
    large = {
        "name": "large",
        "stall_torque_n_m": 0.5,
        "no_load_rate_deg_s": 25000.0,
        "rotor_inertia_kg_m2": 2e-5,
        "gear_ratio": [5.0, 10.0, 20.0],
    }
    doublet = {"kind": "doublet", "aileron_deg": 5.0, "length_s": 0.2}
    wanted = {"actuator": "tab", "candidates": [small, large], "feed_back_inertia": True}
    loads = {"system_factor": 1.25, "ground_gust": None}
    on_doublet = {"actuator": "tab", "candidates": [small], "manoeuvre": doublet, "duration_s": 1.0}
    return {
        "tab": _shown("two candidates for the tab, their rotors fed back", wanted),
        "doublet": _shown("one candidate, on a doublet, no ground gust", on_doublet | {"load_cases": loads}),
    }


def _inverse_sizing() -> Examples:
    rate = {"actuator": "tab", "limits": {"rate_deg_s": 250.0}}
    torque = {"actuator": "tab", "limits": {"torque_n_m": 0.12, "deflection_deg": 20.0}}
    return {
        "rate": _shown("a slower tab actuator", rate),
        "torque": _shown("a weaker one", torque),
    }


def _previews() -> Examples:
    one_point = example(NAMES[0])
    one_point["grid"] = {"altitude_m": [0.0], "dynamic_pressure_pa": [980.0]}
    one_point["controllers"] = [one_point["controllers"][0] | {"gains": {"K_p": 0.3, "K_d": 0.002, "K_i": 4.0}}]
    weights = example(NAMES[0])
    weights["controllers"] = weights["controllers"][2:]
    looked_at = ["point", "root_locus", "response", "frequency_response"]
    return {
        "gains": _shown("Gains that are given, at one point", {"request": one_point, "studies": looked_at}),
        "weights": _shown(
            "Weights over a grid", {"request": weights, "studies": ["actuator_requirements", "response"], "point": 3}
        ),
    }


def _shown(summary: str, value: dict[str, Any]) -> dict[str, Any]:
    return {"summary": summary, "value": value}


def _requirements() -> Examples:
    rate_limited = {
        "manoeuvre": {"kind": "step", "aileron_deg": 10.0, "rate_limit_deg_s": 60.0}, "duration_s": 1.0,
    }  # fmt: skip
    simulated = {
        "manoeuvre": {"kind": "doublet", "aileron_deg": 5.0, "length_s": 0.2},
        "duration_s": 1.0,
        "nonlinear": {"friction": {"aileron": {"static_n_m": 0.05, "kinetic_n_m": 0.04}}},
    }
    return {
        "rate_limited_step": _shown("a step at a limited rate (seed Fig 5.20)", rate_limited),
        "doublet_with_friction": _shown("a doublet, simulated too, with friction in the aileron's hinge", simulated),
    }


def _responses() -> Examples:
    sine = {
        "point": 3,
        "manoeuvre": {"kind": "sine", "aileron_deg": 5.0, "frequency_hz": 2.0},
        "duration_s": 2.0,
        "samples": 201,
    }
    recorded = {
        "point": 3,
        "manoeuvre": {"kind": "recorded", "times_s": [0.0, 0.1, 0.3, 0.3], "aileron_deg": [0.0, 4.0, 4.0, -2.0]},
        "duration_s": 1.0,
        "samples": 201,
    }
    return {
        "sine": _shown("a sine", sine),
        "recorded": _shown("a recorded series, simulated with the actuators' limits", recorded | {"nonlinear": {}}),
    }


def _weight_searches() -> Examples:
    specs = {"settling_time_s_max": 0.3, "overshoot_percent_max": 5.0, "damping_ratio_min": 0.5}
    varying = specs | {"settling_time_s_max": {"axis": "dynamic_pressure_pa", "values": [0.4, 0.35, 0.3, 0.2]}}
    return {
        "one_point": _shown("at one point, within the actuators' limits", {"specs": specs, "points": [3]}),
        "common": _shown(
            "the same weights at two points, with the least peak power, by a settling time that varies",
            {"specs": varying, "minimised": "peak_total_power", "common": True, "points": [2, 3]},
        ),
    }


def _flight_profiles() -> Examples:
    profile = {
        "times_s": [0.0, 1.0, 2.5],
        "altitude_m": [0.0, 500.0, 2500.0],
        "dynamic_pressure_pa": [300.0, 1200.0, 700.0],
    }
    doublet = {"kind": "doublet", "aileron_deg": 5.0, "length_s": 0.5}
    body = {"profile": profile, "manoeuvre": doublet, "duration_s": 3.0, "samples": 151}
    held = {"times_s": [0.0, 2.0], "altitude_m": [1000.0, 1000.0], "airspeed_m_s": [30.0, 50.0]}
    step = {"kind": "step", "aileron_deg": 5.0}
    return {
        "climb": _shown("a doublet while climbing and speeding up", body),
        "held_trim": _shown(
            "a step while speeding up, the controller knowing the first trim only",
            body | {"profile": held, "manoeuvre": step, "duration_s": 2.0, "trim": "held", "estimate_error": True},
        ),
    }


def _uploaded_schedules() -> Examples:
    document = example(NAMES[0])
    plant_parts = ("geometry", "inertia", "aerodynamics", "atmosphere", "trim", "actuators")
    body = {
        "design": {part: document[part] for part in plant_parts},
        "controller": {"kind": "negative_feedback", "rate_filter_hz": 100.0},
    }
    axes = [
        {"name": "altitude_m", "values": [0.0, 3000.0]},
        {"name": "dynamic_pressure_pa", "values": [245.0, 551.25, 1531.25]},
    ]
    rows = {
        "K_d": ("s", [[0.053, 0.025, 0.0098], [0.053, 0.025, 0.0098]]),
        "K_p": ("1", [[1.6, 0.82, 0.37], [1.5, 0.74, 0.32]]),
        "K_i": ("1/s", [[55.0, 46.0, 47.0], [52.0, 43.0, 44.0]]),
    }
    table = {
        "axes": axes,
        "gains": [{"name": name, "unit": unit, "values": values} for name, (unit, values) in rows.items()],
    }
    coarse = {
        "axes": [axes[0], {"name": "dynamic_pressure_pa", "values": [245.0, 3000.0]}],
        "gains": [
            {"name": name, "unit": unit, "values": [[row[0], row[-1]] for row in values]}
            for name, (unit, values) in rows.items()
        ],
    }
    return {
        "proved": _shown("a table that holds", body | {"schedule": table, "proof": {"decay_rate_1_s": 10.0}}),
        "refuted": _shown(
            "stable at its four points, and not between them", body | {"schedule": coarse, "proof": {"fraction": 0.0}}
        ),
    }


def _trade_offs() -> Examples:
    specs = {"settling_time_s_max": 0.3, "overshoot_percent_max": 5.0, "damping_ratio_min": 0.5}
    searched = ["tab_rate_deg_s", "aileron_rate_deg_s", "aileron_integral_deg_s", "aileron_torque_n_m"]
    wanted = {"specs": specs, "count": 4, "points": [3], "searched": searched}
    return {"one_point": _shown("from the fastest to 0.3 s, by four of the weights", wanted)}


def _refinements() -> Examples:
    wanted = {"fraction": 0.9, "altitude_lines": 3, "speed_lines": 6, "uniform": False}
    return {"proved_at_90_percent": _shown("proved at 0.9 of the slowest pole's rate", wanted)}


#: Path -> its examples, by name.
BODIES: dict[str, Callable[[], Examples]] = {
    "/v1/designs": _designs,
    "/v1/previews": _previews,
    "/v1/designs/{id}/controllers/{name}/actuator-selection": _actuator_selection,
    "/v1/designs/{id}/controllers/{name}/inverse-sizing": _inverse_sizing,
    "/v1/hinge-moments": _hinge_moments,
    "/v1/linear-models": _linear_models,
    "/v1/eigenvalue-sweeps": _eigenvalue_sweeps,
    "/v1/steady-state-maps": _steady_state_maps,
    "/v1/similarity": _similarity,
    "/v1/designs/{id}/controllers/{name}/response": _responses,
    "/v1/designs/{id}/controllers/{name}/actuator-requirements": _requirements,
    "/v1/designs/{id}/controllers/{name}/weight-search": _weight_searches,
    "/v1/designs/{id}/controllers/{name}/trade-off": _trade_offs,
    "/v1/designs/{id}/controllers/{name}/refinement": _refinements,
    "/v1/designs/{id}/controllers/{name}/flight-profile": _flight_profiles,
    "/v1/schedules/verify": _uploaded_schedules,
}
