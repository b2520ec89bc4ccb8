"""What a trim is asked to hold: angles, or torques from which angles follow."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from model.arrays import Floats

#: A solved trim angle beyond this is no trim: the surface would stand across the flow [rad].
LARGEST_TRIM_ANGLE = np.pi / 2.0

Surface = Literal["tab", "aileron"]
#: How the tab's angle may be found instead of given.
TabRule = Literal["zero_aileron_torque", "zero_tab_torque", "least_torque"]
#: How the aileron's angle may be found instead of given.
AileronRule = Literal["zero_aileron_torque"]


@dataclass(frozen=True)
class HeldTorque:
    """An angle is not given; it is the one at which the actuator of `surface` holds `torque`.

    Attributes
    ----------
    surface : whose actuator, ``tab`` or ``aileron``
    torque : its torque (*G,) or a number, trailing edge up positive [N m]
    """

    surface: Surface
    torque: Floats = 0.0

    def __post_init__(self) -> None:
        if self.surface not in get_args(Surface):
            raise ValueError(f"surface must be one of {get_args(Surface)}, not {self.surface!r}")
        if not np.all(np.isfinite(self.torque)):
            raise ValueError("a held torque must be finite [N m]")


@dataclass(frozen=True)
class TrimRequest:
    """What to hold: incidence and deflections [rad], numbers or arrays that broadcast against the grid.

    Attributes
    ----------
    alpha : incidence [rad]
    aileron : aileron angle [rad]; or ``zero_aileron_torque``, the angle at which it floats; or a `HeldTorque`
    tab : tab angle relative to the aileron [rad]; or ``zero_aileron_torque``, the tab angle at which the aileron
        stays without any torque from its actuator; or ``zero_tab_torque``, at which the tab does; or
        ``least_torque``, at which ``T_t^2 + T_a^2`` is least; or a `HeldTorque`
    tab_limit, aileron_limit : range in which a solved angle is sought, plus and minus [rad]

    Raises
    ------
    ValueError : an angle that is not finite, an unknown word, a limit outside (0, `LARGEST_TRIM_ANGLE`], or two
        angles to be found from one equation
    """

    alpha: Floats
    aileron: Floats | AileronRule | HeldTorque = 0.0
    tab: Floats | TabRule | HeldTorque = 0.0
    tab_limit: float = LARGEST_TRIM_ANGLE
    aileron_limit: float = LARGEST_TRIM_ANGLE

    def __post_init__(self) -> None:
        for name, rule in (("tab", TabRule), ("aileron", AileronRule)):
            value = getattr(self, name)
            if isinstance(value, str) and value not in get_args(rule):
                raise ValueError(
                    f"{name} must be an angle [rad], a held torque or one of {get_args(rule)}, not {value!r}"
                )
        given = [v for v in (self.alpha, self.aileron, self.tab) if not isinstance(v, str | HeldTorque)]
        if not all(np.all(np.isfinite(angle)) for angle in given):
            raise ValueError("trim angles must be finite [rad]")
        for limit in (self.tab_limit, self.aileron_limit):
            if not 0.0 < limit <= LARGEST_TRIM_ANGLE:
                raise ValueError("limits of solved trim angles must lie in (0, pi/2] [rad]")
        self._refuse_one_equation_for_two_angles()

    @property
    def tab_torque(self) -> HeldTorque | None:
        """The torque that decides the tab's angle; None where the angle is given or ``least_torque``."""
        return _held(self.tab)

    @property
    def aileron_torque(self) -> HeldTorque | None:
        """The torque that decides the aileron's angle; None where the angle is given."""
        return _held(self.aileron)

    def _refuse_one_equation_for_two_angles(self) -> None:
        tab, aileron = self.tab_torque, self.aileron_torque
        if aileron is None:
            return
        if isinstance(self.tab, str) and self.tab == "least_torque":
            raise ValueError("tab 'least_torque' needs a given aileron angle")
        if tab is not None and tab.surface == aileron.surface:
            raise ValueError(f"the torque of the {tab.surface} cannot decide both the tab's and the aileron's angle")


def _held(wanted: Floats | str | HeldTorque) -> HeldTorque | None:
    if isinstance(wanted, HeldTorque):
        return wanted
    if isinstance(wanted, str) and wanted != "least_torque":
        return HeldTorque("aileron" if wanted == "zero_aileron_torque" else "tab")
    return None
