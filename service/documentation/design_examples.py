"""Design requests that the documentation shows, and that run as they stand."""

from __future__ import annotations

from typing import Any

from service.examples import NAMES, example

BRYSON = {
    "rule": "bryson",
    "aileron_deg": 2.0,
    "aileron_rate_deg_s": 200.0,
    "tab_deg": 10.0,
    "tab_rate_deg_s": 400.0,
    "aileron_integral_deg_s": 0.1,
    "tab_torque_n_m": 0.5,
    "aileron_torque_n_m": 2.0,
}


def design_requests() -> dict[str, tuple[str, dict[str, Any]]]:
    """Summary and body of each, by name: the shipped examples, then one for everything else that can be asked."""
    shipped = {name: (name, example(name)) for name in NAMES}
    return shipped | {
        "four_classical_controllers": ("four classical controllers", _four_classical_controllers()),
        "given_gains": ("gains that are given, all of them or some", _given_gains()),
        "specs_over_the_grid": ("specs that vary over the grid, and a spec pack of one's own", _specs_that_vary()),
        "lqr_structures": ("a regulator, an aileron and both surfaces following references", _lqr_structures()),
        "lqr_measured": ("every state measured, filtered rates, a Kalman filter", _lqr_measured()),
        "lqr_sampled": ("state feedback designed for a sample time", _lqr_sampled()),
        "lqr_power": ("power of the actuators weighed, and not", _lqr_power()),
    }


def _four_classical_controllers() -> dict[str, Any]:
    """Both structures, with both commands of the tab's actuator (seed 4.1, 4.2)."""
    negative = {
        "kind": "negative_feedback",
        "specs": {"damping_ratio_min": 0.5, "gain_margin_db_min": 6.0, "phase_margin_deg_min": 45.0},
        "rate_filter_hz": 100.0,
    }
    positive = {"kind": "positive_feedback", "specs": {"damping_ratio_min": 0.4}}
    controllers = [
        {"name": f"{name}_{command}", "tab_command": command, **law}
        for name, law in (("negative", negative), ("positive", positive))
        for command in ("deflection", "rate")
    ]
    return _wind_tunnel("four_classical_controllers", controllers) | {
        "grid": {"altitude_m": [0.0], "dynamic_pressure_pa": [245.0, 551.25, 980.0, 1531.25]}
    }


def _given_gains() -> dict[str, Any]:
    """Gains that are judged as they are; of the last controller, one that is completed."""
    gains = {
        "K_d": {"axis": "dynamic_pressure_pa", "values": [0.053, 0.025, 0.015, 0.0098]},
        "K_p": {"values": [[1.61, 0.82, 0.52, 0.37], [1.5, 0.74, 0.46, 0.32]]},
        "K_i": 44.0,
    }
    given = {"kind": "negative_feedback", "rate_filter_hz": 100.0, "gains": gains}
    digital = {"sample_time_s": 0.001, "computational_delay_s": 0.0005}
    some = {"kind": "positive_feedback", "gains": {"K_f": 0.5}, "specs": {"overshoot_percent_max": 5.0}}
    return _wind_tunnel(
        "given_gains", [{"name": "given"} | given, {"name": "digital"} | given | digital, {"name": "some"} | some]
    )


def _specs_that_vary() -> dict[str, Any]:
    """Damping by dynamic pressure, settling time by altitude and dynamic pressure; gains may vary smoothly."""
    specs = {
        "damping_ratio_min": {"axis": "dynamic_pressure_pa", "values": [0.6, 0.55, 0.5, 0.45]},
        "settling_time_s_max": {"values": [[0.4, 0.35, 0.3, 0.2], [0.5, 0.45, 0.4, 0.3]]},
        "gain_margin_db_min": 6.0,
        "phase_margin_deg_min": 45.0,
        "overshoot_percent_max": 10.0,
    }
    controller = {
        "name": "nf",
        "kind": "negative_feedback",
        "rate_filter_hz": 100.0,
        "specs": specs,
        "smoothing": {"bandwidth_loss_percent_max": 10.0},
    }
    tab_rates = {"axis": "altitude_m", "values": [400.0, 300.0]}
    pack = {"name": "ours", "specs": {"disk_margin_min": 0.6, "tab_rate_deg_s_max": tab_rates}}
    return _wind_tunnel("specs_over_the_grid", [controller]) | {"spec_pack": pack}


def _lqr_structures() -> dict[str, Any]:
    """Torque loops with a lag, that of the tab late too: the last design knows of the delay (seed 3.2.2, 5.3, 5.4)."""
    explicit = {
        "rule": "explicit",
        "Q": [[33.0, 0.0, 0.0, 0.0], [0.0, 0.02, 0.0, 0.0], [0.0, 0.0, 820.0, 0.0], [0.0, 0.0, 0.0, 0.08]],
        "R": [[4.0, 0.0], [0.0, 0.25]],
    }
    document = _wind_tunnel(
        "lqr_structures",
        [
            _lqr("regulator", reference="none", weights=explicit),
            _lqr("aileron", reference="aileron", tab_allocation="least_torque"),
            _lqr("both", reference="aileron_and_tab", weights=BRYSON | {"tab_integral_deg_s": 0.5}, delay_states=2),
        ],
    )
    document["reference"] |= {"tab_deg": 5.0}
    document["actuators"]["tab"] |= {"torque_loop_bandwidth_hz": 80.0, "delay_s": 0.001}
    document["actuators"]["aileron"] |= {"torque_loop_bandwidth_hz": 80.0}
    return document


def _lqr_measured() -> dict[str, Any]:
    """One regulator of all states, of angles with their filtered derivatives, and of estimates (seed 6.3, 7.3)."""
    kalman = {
        "kind": "kalman",
        "tab_torque_noise": 0.002,
        "aileron_torque_noise": 0.01,
        "tab_angle_noise_deg": 0.001,
        "aileron_angle_noise_deg": 0.002,
    }
    return _wind_tunnel(
        "lqr_measured",
        [
            _lqr("all_states"),
            _lqr("filtered", measurement={"kind": "rate_filters", "cutoff_hz": 300.0}),
            _lqr("estimated", measurement=kalman),
            _lqr("recovered", measurement=kalman | {"recovery": 10.0}),
        ],
    )


def _lqr_sampled() -> dict[str, Any]:
    """At 500 Hz with one sample of delay, and at 100 Hz without any (seed 6.4.2)."""
    return _wind_tunnel(
        "lqr_sampled",
        [
            _lqr("at_500_hz", sample_time_s=0.002),
            _lqr("at_100_hz", sample_time_s=0.01, computational_delay_s=0.0),
        ],
    )


def _lqr_power() -> dict[str, Any]:
    """Without regard to power, with peaks that are given, and with a price of net work (seed 5.2)."""
    outputs = {
        "rule": "output",
        "outputs": ["da_error", "int_a", "dt", "dt_rate", "da_rate"],
        "W_y": [
            [800.0, 0.0, 0.0, 0.0, 0.0],
            [0.0, 3e5, 0.0, 0.0, 0.0],
            [0.0, 0.0, 33.0, 0.0, 0.0],
            [0.0, 0.0, 0.0, 0.02, 0.0],
            [0.0, 0.0, 0.0, 0.0, 0.08],
        ],
        "W_u": [[4.0, 0.0], [0.0, 0.25]],
    }
    balanced = {"rule": "power", "form": "balanced", "base": BRYSON, "tab_power_w": 1.2, "aileron_power_w": 20.0}
    work = {"tab_price": 1.0, "aileron_price": 1.0, "part": 0.5}
    return _wind_tunnel(
        "lqr_power",
        [
            _lqr("before"),
            _lqr("after", weights=balanced),
            _lqr("net_work", weights={"rule": "power", "form": "net_work", "base": outputs} | work),
        ],
    )


def _lqr(name: str, **fields: Any) -> dict[str, Any]:
    return {"name": name, "kind": "lqr", "weights": BRYSON} | fields


def _wind_tunnel(name: str, controllers: list[dict[str, Any]]) -> dict[str, Any]:
    return example(NAMES[0]) | {"name": name, "controllers": controllers}
