"""What is seen of a flight over a profile: outputs as totals, torques, and what the actuators must do."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from design.response.demand import ActuatorDemand
from design.simulation.anti_windup import anti_windup_gain
from design.simulation.demand import AT_LIMIT, LIMITS, demands, limit_signals, time_at_limits
from design.simulation.dynamics import Flown, limit_or_infinite
from design.simulation.plant import AirResidual
from design.simulation.quadrature import derivative, runs
from design.simulation.request import SURFACES, SimulationRequest
from design.simulation.signals import Signals
from design.simulation.trajectory import Trajectory, dynamics_of
from model.arrays import BoolArray, FloatArray, GridArrays, IntArray
from schedules.profile_instants import Instants, times_vector
from schedules.profile_steps import Nodes
from schedules.requirements import limits_by_name
from schedules.study import Study


@dataclass(frozen=True, eq=False)
class Seen(GridArrays):
    """What is seen at M nodes, without the acceleration of a tab that has no state for its rate.

    Attributes
    ----------
    time, segment : (M,) [s], and the number of the segment
    angle, rate, acceleration : (M, 2) totals of [tab, aileron]; the tab's acceleration nan where it is not known yet
    torque : (M, 2) of the actuators [N m], the tab's without ``inertia`` times that acceleration where it is not
    inertia : (M,) of the tab [kg m^2]
    others : (M, o) outputs of the loop that are neither, in its order; nan elsewhere
    target : (M, p) angles that the surfaces are to have [rad]
    """

    time: FloatArray
    segment: IntArray
    angle: FloatArray
    rate: FloatArray
    acceleration: FloatArray
    torque: FloatArray
    inertia: FloatArray
    others: FloatArray
    target: FloatArray


def seen(nodes: Nodes) -> Seen:
    """What is seen at nodes."""
    there, x, rates = nodes.instants, nodes.states, nodes.rates
    loop, plant = there.loop, there.plant
    at = {name: i for i, name in enumerate(loop.states)}
    tab_rate = x[:, at["dt_rate"]] if "dt_rate" in at else rates[:, at["dt"]]
    second = rates[:, at["dt_rate"]] if "dt_rate" in at else np.full(len(x), np.nan)
    angle, rate = x[:, [at["dt"], at["da"]]], np.stack([tab_rate, x[:, at["da_rate"]]], axis=-1)
    acceleration = np.stack([second, rates[:, at["da_rate"]]], axis=-1)
    commanded = plant.model.input_offset[:, : nodes.commands.shape[-1]] + nodes.commands
    if loop.inputs == ("tab",):
        torque = np.stack([_imposed(nodes, tab_rate, acceleration), plant.model.input_offset[:, 1]], axis=-1)
    else:
        lags = [f"{name}_torque" for name in SURFACES]
        each = [x[:, at[name]] if name in at else commanded[:, i] for i, name in enumerate(lags)]
        torque = np.stack(each, axis=-1)
    followed = [at[{"r_a": "da", "r_t": "dt"}[name]] for name in loop.references]
    target = there.known_trim[:, followed] + nodes.reference
    others = np.full((len(x), len(loop.outputs)), np.nan)
    own = times_vector(loop.C, x - there.known_trim)
    for row, name in enumerate(loop.outputs):
        if name in ("T_t_command", "T_a_command"):
            others[:, row] = commanded[:, 0 if name == "T_t_command" else 1]
        elif name == "dt_command":
            others[:, row] = own[:, row] + there.known_trim[:, at["dt"]]
        elif name == "dt_rate_command":
            others[:, row] = own[:, row]
    return Seen(
        nodes.time, nodes.segment, angle, rate, acceleration, torque, plant.model.inertia[:, 0, 0], others, target
    )


def _imposed(nodes: Nodes, tab_rate: FloatArray, acceleration: FloatArray) -> FloatArray:
    """Torque of a tab whose motion is imposed (M,) [N m], by inverse dynamics; see `Seen.torque`."""
    there, model = nodes.instants, nodes.instants.plant.model
    at = {name: i for i, name in enumerate(there.loop.states)}
    x = nodes.states - there.trim
    motion = np.stack([tab_rate if name == "dt_rate" else x[:, at[name]] for name in model.states], axis=-1)
    beyond = AirResidual(there.plant).torque(x[:, at["dt"]], tab_rate, x[:, at["da"]], x[:, at["da_rate"]])
    air = times_vector(model.air_torque, motion)[:, 0] + beyond[0] - model.input_offset[:, 0]
    J = model.inertia[:, 0]
    known = np.nan_to_num(acceleration[:, 0], nan=0.0)
    return np.asarray(J[:, 0] * known + J[:, 1] * acceleration[:, 1] - air)


def joined(parts: list[Seen]) -> Seen:
    """What is seen at the nodes of several batches in a row.

    Of a stretch that has broken off after its first node nothing is left: no rate of change can be told there.

    Raises
    ------
    ValueError : nothing but that is left
    """
    whole = Seen(*(np.concatenate([getattr(part, f.name) for part in parts]) for f in fields(Seen)))
    if np.count_nonzero(whole.segment == whole.segment[-1]) > 1:
        return whole
    if whole.segment[-1] == whole.segment[0]:
        raise ValueError("the flight diverges within its first step")
    return whole.take(slice(-1))


def sampled_nodes(found: Seen, substeps: IntArray) -> IntArray:
    """Nodes that are samples (T,): one in every `substeps` (segments,), later ones of two at one time."""
    chosen = [np.arange(rows.start, rows.stop - 1, substeps[found.segment[rows.start]]) for rows in runs(found.segment)]
    return np.concatenate([*chosen, [len(found.time) - 1]]).astype(np.int64)


def completed(found: Seen) -> Seen:
    """With the acceleration of the tab from its rate, where there is no state for that."""
    if np.isfinite(found.acceleration[:, 0]).all():
        return found
    second = derivative(found.time, found.segment, found.rate[:, :1])[:, 0]
    acceleration, torque = found.acceleration.copy(), found.torque.copy()
    acceleration[:, 0] = second
    torque[:, 0] += found.inertia * second
    return Seen(
        found.time, found.segment, found.angle, found.rate, acceleration, torque, found.inertia, found.others,
        found.target,
    )  # fmt: skip


def outputs(found: Seen, names: tuple[str, ...]) -> FloatArray:
    """(M, o) outputs of the loop in its order, totals."""
    by_name = {
        "dt": found.angle[:, 0], "da": found.angle[:, 1], "dt_rate": found.rate[:, 0], "da_rate": found.rate[:, 1],
        "T_t": found.torque[:, 0], "T_a": found.torque[:, 1],
    }  # fmt: skip
    return np.stack([by_name.get(name, found.others[:, i]) for i, name in enumerate(names)], axis=-1)


@dataclass(frozen=True, eq=False)
class Asked:
    """What a flight asks of the actuators of its loop.

    Attributes
    ----------
    demand : of each of them, single numbers; nan where the flight has diverged
    at_limit : (M, 2, 4) which limits are reached: [tab, aileron] by [deflection, rate, torque, power]
    time_at_limit : (2, 4) how long [s]
    """

    demand: tuple[ActuatorDemand, ...]
    at_limit: BoolArray
    time_at_limit: FloatArray


def asked(study: Study, first: Instants, found: Seen, diverged_at: float) -> Asked:
    """Demands over a whole flight, by the figures of simulations (`design.simulation.demand`).

    Parameters
    ----------
    first : the first instant (1,), for what is the same in all of them
    diverged_at : when the flight has diverged [s]; nan where it has not
    """
    duration = float(found.time[-1])
    unlimited = SimulationRequest(duration, limits={})
    flown = Flown(first.plant, first.loop, anti_windup_gain(first.loop, 0.0), unlimited)
    nothing = np.zeros((len(found.time), 2, 1))
    course = Trajectory(
        found.time, found.segment, nothing, nothing, nothing, nothing, nothing.astype(np.int64), nothing,
        nothing[:, 0], np.array([diverged_at]), np.zeros(0, dtype=np.int64),
    )  # fmt: skip
    angle, rate, acceleration, torque = (
        each[..., None] for each in (found.angle, found.rate, found.acceleration, found.torque)
    )
    signals = Signals(torque, angle, rate, acceleration, torque, angle, rate, nothing, nothing)
    demand = tuple(each.take(0) for each in demands(dynamics_of(flown), course, signals))
    request = SimulationRequest(duration, limits=limits_by_name(study))
    limits = np.array([[limit_or_infinite(request, name, what) for what in LIMITS] for name in SURFACES])
    reached = limit_signals(signals) >= AT_LIMIT * limits[..., None]
    return Asked(demand, reached[..., 0], time_at_limits(course, reached)[0])
