"""Units of the signals of a loop on the wire, and of what one does to another."""

from __future__ import annotations

from math import degrees

#: Signal -> its unit inside. Disturbances and noise end in what they are of.
_INSIDE = {
    "da": "rad",
    "dt": "rad",
    "da_rate": "rad/s",
    "dt_rate": "rad/s",
    "dt_command": "rad",
    "dt_rate_command": "rad/s",
    "dt_actuator": "rad",
    "dt_actuator_rate": "rad/s",
    "tab_torque": "N m",
    "aileron_torque": "N m",
    "T_t": "N m",
    "T_a": "N m",
    "T_t_command": "N m",
    "T_a_command": "N m",
    "r_a": "rad",
    "r_t": "rad",
}
#: Unit inside -> unit on the wire, and how many of it make one inside.
_ON_THE_WIRE = {"rad": ("deg", degrees(1.0)), "rad/s": ("deg/s", degrees(1.0)), "N m": ("N m", 1.0)}
#: Ratios of units that have a name of their own.
_RATIOS = {("deg/s", "deg"): "1/s", ("deg", "deg/s"): "s"}


def signal_unit(name: str, commands: dict[str, str]) -> tuple[str, float]:
    """Unit of a signal on the wire, and its size: how many of it make one unit inside.

    Parameters
    ----------
    name : an output, a reference, a disturbance or noise of a loop, or one of its inputs
    commands : the signal that each input is, by the input's name (`command_signals`)
    """
    bare = name.removesuffix("_disturbance").removesuffix("_noise")
    return _ON_THE_WIRE[_INSIDE[commands.get(bare, bare)]]


def command_signals(outputs: tuple[str, ...], inputs: tuple[str, ...]) -> dict[str, str]:
    """What each input commands: a rate or a deflection of the tab, where that is an output, or else a torque."""
    if "dt_rate_command" in outputs:
        return {"tab": "dt_rate_command"}
    if "dt_command" in outputs:
        return {"tab": "dt_command"}
    return {name: {"tab": "T_t", "aileron": "T_a"}[name] for name in inputs}


def ratio_unit(to: str, per: str) -> str:
    """Unit of a transfer from one unit to another: ``deg/(N m)``, or ``1`` for the same."""
    return "1" if to == per else _RATIOS.get((to, per), f"{to}/({per})")
