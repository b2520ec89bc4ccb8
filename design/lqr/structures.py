"""What is built around the model: references and integrals, and how its torques come about (seed 5.3, 5.4).

::

    u_i --> [delay] --> [w / (s + w)] --> T_i --> model        int_a' = r_a - da
    command             torque loop       torque               int_t' = r_t - dt

=================== ============== ==========
reference           integrals      references
=================== ============== ==========
``none``            none           none
``aileron``         ``int_a``      ``r_a``
``aileron_and_tab`` ``int_a int_t`` ``r_a r_t``
=================== ============== ==========
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Literal, get_args

from design.delay.characteristic import SHORTEST
from model.actuators import Actuator
from model.linear_model import STATES

Reference = Literal["none", "aileron", "aileron_and_tab"]

#: The angle that each reference is followed by, and the integral of its error.
FOLLOWED: dict[str, str] = {"r_a": "da", "r_t": "dt"}
INTEGRALS: dict[str, str] = {"r_a": "int_a", "r_t": "int_t"}

_REFERENCES: dict[Reference, tuple[str, ...]] = {"none": (), "aileron": ("r_a",), "aileron_and_tab": ("r_a", "r_t")}


@dataclass(frozen=True)
class TorqueDrive:
    """What lies between the command of a torque and the torque.

    Attributes
    ----------
    name : of the actuator, ``tab`` or ``aileron``
    bandwidth : of the first-order lag of the torque loop [rad/s]; None where it is ideal
    delay : transport delay of the command [s]
    delay_states : states of the delay's approximant in the design; 0 where the design leaves the delay out
    """

    name: str
    bandwidth: float | None
    delay: float
    delay_states: int

    @property
    def torque_state(self) -> str | None:
        """Name of the state that is the torque; None where the torque is the command."""
        return None if self.bandwidth is None else f"{self.name}_torque"

    @property
    def chain(self) -> tuple[str, ...]:
        """Names of the states of the delay in the design (`design.delay.pade`)."""
        return tuple(f"{self.name}_delay_{k + 1}" for k in range(self.delay_states))


@dataclass(frozen=True)
class Structure:
    """A structure of concurrent actuation.

    Attributes
    ----------
    reference : what follows a reference
    tab, aileron : the actuators: bandwidth of the torque loop, delay, limits
    delay_states : states that the design gives to each delay there is; 0 leaves the delays out of the design, which
        is judged with them all the same

    Raises
    ------
    ValueError : an unknown reference, a bandwidth that is not positive, a delay or a number of states below zero
    """

    reference: Reference = "aileron"
    tab: Actuator = field(default_factory=Actuator)
    aileron: Actuator = field(default_factory=Actuator)
    delay_states: int = 0

    def __post_init__(self) -> None:
        if self.reference not in get_args(Reference):
            raise ValueError(f"reference must be one of {get_args(Reference)}, not {self.reference!r}")
        for name, actuator in (("tab", self.tab), ("aileron", self.aileron)):
            bandwidth = actuator.torque_loop_bandwidth
            if bandwidth is not None and not 0.0 < bandwidth < float("inf"):
                raise ValueError(f"bandwidth of the {name}'s torque loop: must be positive, not {bandwidth}")
            if not 0.0 <= actuator.delay < float("inf"):
                raise ValueError(f"delay of the {name}'s torque: must be at least 0, not {actuator.delay}")
        if self.delay_states < 0:
            raise ValueError(f"a delay cannot have {self.delay_states} states")

    @property
    def references(self) -> tuple[str, ...]:
        """Names of the references."""
        return _REFERENCES[self.reference]

    @property
    def integrals(self) -> tuple[str, ...]:
        """Names of the integrals of the errors, in the order of the references."""
        return tuple(INTEGRALS[name] for name in self.references)

    @property
    def drives(self) -> tuple[TorqueDrive, TorqueDrive]:
        """What lies before each torque, order [tab, aileron]."""
        return self._drive("tab", self.tab), self._drive("aileron", self.aileron)

    def _drive(self, name: str, actuator: Actuator) -> TorqueDrive:
        modelled = self.delay_states if actuator.delay > SHORTEST else 0
        return TorqueDrive(name, actuator.torque_loop_bandwidth, actuator.delay, modelled)

    def weighted_states(self) -> tuple[str, ...]:
        """The states that weights are over at least: angles and rates, then the integrals."""
        return (*STATES, *self.integrals)

    def states(self, of_model: tuple[str, ...]) -> tuple[str, ...]:
        """All states: `weighted_states`, torques, the model's lag states, delays."""
        torques = (drive.torque_state for drive in self.drives if drive.torque_state is not None)
        return (*self.weighted_states(), *torques, *of_model[len(STATES) :], *self._chains())

    def _chains(self) -> Iterator[str]:
        for drive in self.drives:
            yield from drive.chain
