"""Margins at one actuator of a loop whose other actuator is late as well.

`Loop.cut` closes the other inputs without their delays. What is cut here keeps them: those of the others as chains of
states (`design.delay.with_pade`), its own exactly.
"""

from __future__ import annotations

from dataclasses import replace

from design.delay.with_pade import without_delay
from design.frequency.margins import Margins, margins
from design.loop import Loop, SisoLoop

#: States of the other inputs' delays: margins are right to 1e-8 where the crossovers times the delay are below 3.
ORDER = 8


def margins_of_cuts(loop: Loop) -> tuple[Margins, ...]:
    """Margins at each actuator input, the others closed with their delays, in the order of the inputs.

    Parameters
    ----------
    loop : its arrays finite
    """
    if not any(loop.delay):
        stacked = margins(loop.cuts())
        return tuple(stacked.take(i) for i in range(len(loop.inputs)))
    return tuple(margins(late_cut(loop, name)) for name in loop.inputs)


def late_cut(loop: Loop, name: str) -> SisoLoop:
    """The loop opened at one actuator input, the others closed through approximants of their delays."""
    own = tuple(delay if actuator == name else 0.0 for actuator, delay in zip(loop.inputs, loop.delay, strict=True))
    others = tuple(delay - mine for delay, mine in zip(loop.delay, own, strict=True))
    return replace(without_delay(replace(loop, delay=others), ORDER), delay=own).cut(name)
