"""The door to python-control: loops and models as its systems, and the figures of a loop by its own functions.

This is the one file that imports ``control``, and it does so when a function is called: the import takes seconds.

A loop is put together here from its open-loop parts by python-control's own block algebra (`control.interconnect`), so
that poles, margins and steps share no code with `design.assess` but the plant, the actuators and the gains ::

    r --> [ law ] --> <input>_command --> [ delay ] --> <input> --> [ plant ] --> states --> [ law ]

python-control has no transport delays. In continuous time they are exact in the margins of their own cut, and Pade
approximants of `PADE` states elsewhere; sampled, they are exact, by two discretisations of the plant within a sample
(Astrom and Wittenmark, Computer-Controlled Systems, 3rd ed., 1997, section 2.3).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import floor
from typing import Any

import numpy as np

from design.control_figures import Code, ControlMargins, ControlStep
from design.delay.characteristic import SHORTEST
from design.delay.with_pade import without_delay
from design.disturbance.closed_system import closed_system
from design.estimation.readings import is_controllers
from design.loop import Loop
from model.arrays import ComplexArray, FloatArray
from model.linear_model import LinearModel

#: States of the approximant of a delay in poles, steps and the margins of other cuts.
PADE = 10
#: A pole with more than this many radians within the delay is not known from such an approximant.
KNOWN_TURN = 6.0
#: Samples of a step, and frequencies of a loop transfer.
STEP_SAMPLES, FREQUENCIES = 20_001, 1500
#: Time constants of its slowest mode after which a response is at rest.
LASTING = 25.0
#: Gain margins beyond this are none [dB], without and with a delay in continuous time: as `design.frequency` has it.
FARTHEST, FARTHEST_DELAYED = 120.0, 60.0
#: A delay this near to whole samples, in samples, is whole.
WHOLE = 2e-9


def version() -> str:
    """Version of python-control."""
    import control as ct

    return str(ct.__version__)


def model_state_space(model: LinearModel, index: tuple[int, ...] = ()) -> Any:
    """The linear model at a grid point as a ``control.StateSpace`` with the names of its states, inputs and outputs.

    Angles [rad], rates [rad/s] and torques [N m] are deviations from trim, trailing edge up positive.
    """
    import control as ct

    here = model.take(index)
    names = {"states": list(model.states), "inputs": list(model.inputs), "outputs": list(model.outputs)}
    return ct.ss(here.A, here.B, here.C, here.D, name="tab_aileron", **names)


def to_state_space(
    loop: Loop, index: tuple[int, ...] = (), inputs: tuple[str, ...] | None = None, outputs: tuple[str, ...] = ()
) -> Any:
    """The closed loop at a grid point as a ``control.StateSpace`` with named signals.

    Parameters
    ----------
    loop : over any grid; its delays become chains of states (`design.delay.with_pade`)
    index : of the point
    inputs : names of references and disturbances; the references when left out
    outputs : names of outputs, as deviations from trim, and of commands; all outputs when left out

    Raises
    ------
    ValueError : the loop has no such name, or an output takes the rate of an input, which no state space has
    """
    import control as ct

    here = without_delay(loop.take(index))
    system = closed_system(here, loop.references if inputs is None else inputs, outputs or loop.outputs)
    if np.any(system.R):
        raise ValueError("an output takes the rate of an input that may jump: leave that output or input out")
    names = {"states": list(here.states), "inputs": list(system.inputs), "outputs": list(system.outputs)}
    return ct.ss(system.A, system.B, system.C, system.D, name="closed_loop", **names)


def opened_state_space(loop: Loop, name: str, index: tuple[int, ...] = ()) -> Any:
    """The loop transfer L cut at one actuator input as a ``control.StateSpace``, the other inputs closed.

    The return difference is ``1 + L``. The delay at the cut itself is left out; those of the others are approximants.
    """
    here = loop.take(index)
    return _opened(_continuous_parts(_prompt(here, name)), name)


def nonlinear_system(
    update: Callable[..., FloatArray],
    output: Callable[..., FloatArray],
    states: tuple[str, ...],
    inputs: tuple[str, ...],
    outputs: tuple[str, ...],
    name: str,
) -> Any:
    """A ``control.NonlinearIOSystem`` of ``update(t, x, u)`` and ``output(t, x, u)``, with named signals."""
    import control as ct

    def updated(t: float, x: FloatArray, u: FloatArray, _: Any) -> FloatArray:
        return update(t, x, u)

    def seen(t: float, x: FloatArray, u: FloatArray, _: Any) -> FloatArray:
        return output(t, x, u)

    return ct.nlsys(
        updated if states else None, seen, states=list(states), inputs=list(inputs), outputs=list(outputs), name=name
    )


def optimal_gain(
    A: FloatArray, B: FloatArray, Q: FloatArray, R: FloatArray, N: FloatArray, discrete: bool
) -> FloatArray:
    """K (m, n) by `control.lqr` or `control.dlqr` of ``x'Qx + u'Ru + 2x'Nu``, Q and R symmetric up to rounding.

    Raises
    ------
    ValueError, numpy.linalg.LinAlgError, control.ControlArgument : what python-control refuses
    """
    import control as ct

    # python-control takes no asymmetry beyond one rounding of 1, however large the weights are.
    Q, R = 0.5 * (Q + Q.mT), 0.5 * (R + R.mT)
    K, _, _ = (ct.dlqr if discrete else ct.lqr)(A, B, Q, R, N)
    return np.asarray(K, dtype=float)


def control_poles(loop: Loop, code: Code | None = None) -> ComplexArray:
    """Closed-loop poles [rad/s] of a loop at one point; sampled ``ln z / T``, those at z = 0 left out.

    With a delay in continuous time only those that the approximant knows.
    """
    poles = np.asarray(_closed(_parts(loop, code), loop.references).poles(), dtype=complex)
    if code is not None:
        return np.asarray(np.log(poles[poles != 0.0]) / code.sampling.time)
    late = max(loop.delay)
    return poles[np.abs(poles) * late <= KNOWN_TURN] if late > SHORTEST else poles


def control_margins(loop: Loop, code: Code | None = None) -> tuple[ControlMargins, ...]:
    """Margins at each actuator input of a loop at one point, the other inputs closed."""
    closed = np.asarray(_closed(_parts(loop, code), loop.references).poles(), dtype=complex)
    if code is not None:
        parts = _parts(loop, code)
        return tuple(_margins(_opened(parts, name), closed, 0.0) for name in loop.inputs)
    cuts = (_opened(_continuous_parts(_prompt(loop, name)), name) for name in loop.inputs)
    return tuple(_margins(cut, closed, late) for cut, late in zip(cuts, loop.delay, strict=True))


def control_step(loop: Loop, reference: FloatArray, duration: float) -> ControlStep:
    """Figures of the aileron after a step (p,) of the references [rad] of a continuous loop at one point.

    Followed for `duration`, or until nothing is left of its slowest mode, so that samples are not spent on rest.

    Raises
    ------
    ValueError : 90 % of the change is not reached, without which `control.step_info` has no figures
    """
    import control as ct

    system = _closed(_continuous_parts(loop), loop.references)
    slowest = -float(np.max(np.real(system.poles())))
    followed = min(duration, LASTING / slowest) if slowest > 0.0 else duration
    time = np.linspace(0.0, followed, STEP_SAMPLES)
    moved = np.asarray(ct.forced_response(system, time, np.repeat(reference[:, None], time.size, axis=1)).outputs)
    final = float(np.atleast_2d(np.asarray(system.dcgain()))[0] @ reference)
    if final == 0.0 or np.max(moved / final) < 0.9:
        raise ValueError(f"90 % of the change is not reached within {followed:.6g} s, which step_info needs")
    info = ct.step_info(moved.reshape(-1), time, final_output=final)
    trim = float(loop.offset[loop.outputs.index("da")])
    return ControlStep(
        rise_time=float(info["RiseTime"]),
        settling_time=float(info["SettlingTime"]),
        overshoot=float(info["Overshoot"]) / 100.0,
        undershoot=float(info["Undershoot"]) / 100.0,
        steady_state_value=final + trim,
        resolution=float(time[1]),
    )


@dataclass(frozen=True, eq=False)
class _Parts:
    """Systems of a loop: all but the `actuators`, the one of each input from ``<input>_command`` to ``<input>``."""

    systems: tuple[Any, ...]
    actuators: dict[str, Any]


def _parts(loop: Loop, code: Code | None) -> _Parts:
    return _continuous_parts(loop) if code is None else _sampled_parts(loop, code)


def _closed(parts: _Parts, references: tuple[str, ...]) -> Any:
    """From the references, or without any from a command beside the law's, to the aileron's angle."""
    import control as ct

    systems = [*parts.systems, *parts.actuators.values()]
    inputs = references or tuple(f"{name}_command" for name in parts.actuators)
    return ct.interconnect(systems, inputs=list(inputs), outputs=["da"], check_unused=False)


def _opened(parts: _Parts, name: str) -> Any:
    """From a command to minus what the law commands, everything else closed; the actuator after the cut."""
    import control as ct

    others = [system for other, system in parts.actuators.items() if other != name]
    own, sent = parts.actuators[name], f"{name}_sent"
    own = ct.ss(own.A, own.B, own.C, own.D, own.dt, inputs=[sent], outputs=own.output_labels, name=own.name)
    whole = ct.interconnect(
        [*parts.systems, *others, own], inputs=[sent], outputs=[f"{name}_command"], check_unused=False
    )
    return -ct.ss(whole.A, whole.B, whole.C, whole.D, whole.dt)


def _continuous_parts(loop: Loop) -> _Parts:
    import control as ct

    refused = [name for name, delay in zip(loop.inputs, loop.delay, strict=True) if delay < 0.0]
    if refused:
        raise ValueError(f"the delay of {', '.join(refused)} is negative")
    states, commands = list(loop.states), [f"{name}_command" for name in loop.inputs]
    B = np.hstack([loop.B, loop.E])
    plant = ct.ss(
        loop.A, B, np.eye(len(states)), np.zeros(B.shape),
        inputs=[*loop.inputs, *loop.references], outputs=states, name="plant",
    )  # fmt: skip
    law = ct.ss(
        [], [], [], np.hstack([-loop.K, loop.N]),
        inputs=[*states, *loop.references], outputs=commands, name="law",
    )  # fmt: skip
    actuators = {name: _late(name, delay) for name, delay in zip(loop.inputs, loop.delay, strict=True)}
    return _Parts((plant, law), actuators)


def _prompt(loop: Loop, name: str) -> Loop:
    """The loop without the delay of one input."""
    delays = zip(loop.inputs, loop.delay, strict=True)
    return replace(loop, delay=tuple(0.0 if each == name else delay for each, delay in delays))


def _late(name: str, delay: float) -> Any:
    """The approximant of a delay, of a unit delay in a slower time: its coefficients are of one size."""
    import control as ct

    signals = {"inputs": [f"{name}_command"], "outputs": [name], "name": f"{name}_actuator"}
    if delay <= SHORTEST:
        return ct.ss([], [], [], [[1.0]], **signals)
    chain = ct.ss(ct.tf(*ct.pade(1.0, PADE, PADE - 1)))
    return ct.ss(chain.A / delay, chain.B / delay, chain.C, chain.D, **signals)


def _sampled_parts(loop: Loop, code: Code) -> _Parts:
    T = code.sampling.time
    own = [i for i, name in enumerate(loop.states) if is_controllers(name)]
    plant = [i for i in range(len(loop.states)) if i not in own]
    measured = [loop.states[i] for i in plant]
    samples = [(delay + code.sampling.delay) / T for delay in loop.delay]
    samples = [float(round(each)) if abs(each - round(each)) <= WHOLE else each for each in samples]
    plant_system = _held_plant(loop.A[np.ix_(plant, plant)], loop.B[plant], measured, loop.inputs, samples, T)
    actuators = {
        name: _register(f"{name}_command", (f"{name}_now", f"{name}_before"), (floor(each), floor(each) + 1), T)
        for name, each in zip(loop.inputs, samples, strict=True)
    }
    return _Parts((plant_system, *_code(loop, code, own, plant)), actuators)


def _held_plant(
    A: FloatArray, B: FloatArray, states: list[str], inputs: tuple[str, ...], samples: list[float], T: float
) -> Any:
    """The plant from sample to sample, each input held from a part of a sample on, until then the one before."""
    import control as ct

    n = len(states)
    plant = ct.ss(A, B, np.eye(n), np.zeros(B.shape))
    columns = []
    for i, each in enumerate(samples):
        part = (each - floor(each)) * T
        late = ct.c2d(plant, T - part, "zoh")
        first = ct.c2d(plant, part, "zoh").B[:, i] if part > 0.0 else np.zeros(n)
        columns += [late.B[:, i], late.A @ first]
    whole, names = ct.c2d(plant, T, "zoh"), [f"{name}_{when}" for name in inputs for when in ("now", "before")]
    B = np.stack(columns, axis=-1)
    return ct.ss(whole.A, B, np.eye(n), np.zeros(B.shape), T, inputs=names, outputs=states, name="plant")


def _register(source: str, outputs: tuple[str, ...], ages: tuple[int, ...], T: float) -> Any:
    """A shift register: its input as it was so many samples ago."""
    import control as ct

    n = max(ages)
    C, D = np.zeros((len(ages), n)), np.zeros((len(ages), 1))
    for row, age in enumerate(ages):
        if age:
            C[row, age - 1] = 1.0
        else:
            D[row] = 1.0
    B = np.eye(n)[:, :1]
    return ct.ss(np.eye(n, k=-1), B, C, D, T, inputs=[source], outputs=list(outputs), name=f"{outputs[0]}_register")


def _code(loop: Loop, code: Code, own: list[int], plant: list[int]) -> list[Any]:
    """The controller's states by Tustin's rule, its law, and its memory of its own commands."""
    import control as ct

    T, m = code.sampling.time, len(loop.inputs)
    read = [*(loop.states[i] for i in plant), *loop.references]
    made, commands = [f"{name}_code" for name in loop.inputs], [f"{name}_command" for name in loop.inputs]
    D = np.hstack([-loop.K[:, plant], loop.N])
    if own:
        rows = loop.A[own]
        controller = ct.ss(rows[:, own], np.hstack([rows[:, plant], loop.E[own]]), -loop.K[:, own], D)
        sampled = ct.c2d(controller, T, "bilinear")
        law = ct.ss(sampled.A, sampled.B, sampled.C, sampled.D, T, inputs=read, outputs=made, name="law")
    else:
        law = ct.ss([], [], [], D, T, inputs=read, outputs=made, name="law")
    held = [
        [f"{name}_held_{age + 1}" for age in range(count)]
        for name, count in zip(loop.inputs, code.waiting, strict=True)
    ]
    remembered = [name for names in held for name in names]
    sent = ct.ss(
        [], [], [], np.hstack([np.eye(m), -code.held_gain]), T,
        inputs=[*made, *remembered], outputs=commands, name="sent",
    )  # fmt: skip
    memories = [
        _register(command, tuple(names), tuple(range(1, len(names) + 1)), T)
        for command, names in zip(commands, held, strict=True)
        if names
    ]
    return [law, sent, *memories]


def _margins(cut: Any, closed: ComplexArray, delay: float) -> ControlMargins:
    """Margins of a loop transfer L and a delay, from its values at many frequencies."""
    import control as ct

    omega = _frequencies(cut, closed, delay)
    value = np.asarray(ct.frequency_response(cut, omega).frdata[0, 0]) * np.exp(-1j * omega * delay)
    ratio, phase, distance, _, _, _ = ct.stability_margins(ct.frd(value, omega), returnall=True)
    farthest = 10.0 ** ((FARTHEST_DELAYED if delay > SHORTEST else FARTHEST) / 20.0)
    ratio = np.concatenate([ratio, _at_the_ends(cut)])
    ratio = ratio[(ratio > 1.0 / farthest) & (ratio < farthest)]
    up, down = ratio[ratio > 1.0], ratio[ratio < 1.0]
    return ControlMargins(
        gain_margin_up_db=float(20.0 * np.log10(up.min())) if up.size else np.inf,
        gain_margin_down_db=float(20.0 * np.log10(down.max())) if down.size else -np.inf,
        phase_margin=float(np.deg2rad(np.abs(phase).min())) if len(phase) else np.inf,
        sensitivity_peak=float(1.0 / min(1.0, np.min(distance, initial=1.0), np.abs(1.0 + value).min())),
    )


def _at_the_ends(cut: Any) -> FloatArray:
    """Critical gains over the gain flown at zero frequency and at half the sampling rate, where L is real."""
    ends = [1.0, -1.0] if cut.isdtime(strict=True) else [0.0]
    found = []
    for z in ends:
        value = complex(np.asarray(cut(z, warn_infinite=False)).reshape(-1)[0])
        if np.isfinite(value) and value.real < 0.0:
            found.append(-1.0 / value.real)
    return np.array(found)


def _frequencies(cut: Any, closed: ComplexArray, delay: float) -> FloatArray:
    """Frequencies [rad/s] over all modes of the loop, open and closed, and close to those that hardly decay."""
    modes = np.concatenate([closed, np.asarray(cut.poles(), dtype=complex)])
    top = np.inf
    if cut.isdtime(strict=True):
        top = np.pi / cut.dt * (1.0 - 1e-9)
        modes = np.log(modes[np.abs(modes) > 1e-6]) / cut.dt
    size = np.abs(modes)
    size = size[size > 1e-6 * size.max()]
    high = min(1e3 * size.max(), top, max(60.0 / delay, 10.0 * size.max()) if delay > 0.0 else np.inf)
    place = [np.abs(modes.imag) + side * np.abs(modes.real) for side in np.linspace(-3.0, 3.0, 25)]
    omega = np.concatenate([np.geomspace(1e-3 * size.min(), high, FREQUENCIES), *place])
    return np.unique(omega[(omega > 1e-3 * size.min()) & (omega <= high)])
