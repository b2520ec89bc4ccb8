"""The closed loop at instants of a flight: plant, trims, gains and the matrices between them, in one batch.

States are totals: angles, torques of torque loops and filters as they are, not from a trim. With X_0, U_0 the trim of
the plant at the instant, X_c, U_c that of the controller, K and N the gains of the schedule there, and v what the
command is more than U_0, the loop of the instant (`design.loop`) says

    v  = U_c - U_0 - K (X - X_c) + N r
    X' = A (X - X_0) + B v + E r + [0, J^-1 R(X - X_0)]         but for the integrals
    int_a' = r_a - (da - da_c),    int_t' = r_t - (dt - dt_c)

The rates of the trims do not appear: the equations of the bodies, of drives and of filters hold for totals, and in
A and B the trim is only where they are zero. An integral is one of the error itself and its gain stands behind it, so
a gain that changes jerks the command by ``K_i' int``: as it is flown when it is coded so.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from design.classical.controller import ClassicalController
from design.classical.tab_loop import tab_loop
from design.estimation.rate_filters import with_rate_filters
from design.gains import Gain
from design.loop import Loop
from design.lqr.flown import flown_loop
from design.lqr.measurement import RateFilters
from design.simulation.anti_windup import INTEGRALS
from design.simulation.plant import NonlinearPlant
from model.arrays import BoolArray, FloatArray, GridArrays
from model.flight import FlightCondition
from model.linear_model import LinearModel
from model.linearise import linearise
from model.servo_tab import servo_tab
from model.trim import trim
from schedules.analysis import PlantEnvelope
from schedules.designed import DesignedController
from schedules.interpolate import interpolate
from schedules.profile import FlightProfile, ProfileRefused
from schedules.profile_time import coordinates
from schedules.schedule import GainSchedule, Provenance
from schedules.study import Study

#: Tables are read here, not written.
_NOWHERE = Provenance("", "", "", "", "")

#: The trim that the controller works from: that of its tables, between the grid points as its gains are; that of the
#: plant at the instant, as if it were known; or the one of the first instant, held.
ControllerTrim = Literal["scheduled", "exact", "held"]


@dataclass(frozen=True, eq=False)
class Instants(GridArrays):
    """The closed loop at P instants: ``X' = M X + f + g r`` and what the air does beyond that.

    Attributes
    ----------
    condition : (P,) air and speed
    plant : (P,) what the air's torque beyond its linear part is made of, and the linear model
    loop : (P,) around that model
    gains : of the schedule, each (P,)
    clipped : (P,) outside the grid, whose edge the gains are of
    trim : (P, n) X_0, states of the loop at the trim of the plant; integrals zero
    known_trim : (P, n) X_c
    ahead : (P, m) ``U_c - U_0``
    """

    condition: FlightCondition
    plant: NonlinearPlant
    loop: Loop
    gains: tuple[Gain, ...]
    clipped: BoolArray
    trim: FloatArray
    known_trim: FloatArray
    ahead: FloatArray

    @property
    def closed(self) -> FloatArray:
        """Closed-loop matrix M (P, n, n)."""
        return self.loop.closed

    @property
    def constant(self) -> FloatArray:
        """What does not depend on the states, f (P, n)."""
        loop = self.loop
        off = times_vector(loop.A, self.trim)
        held = [i for i, name in enumerate(loop.states) if name in INTEGRALS]
        off[:, held] = times_vector(loop.A[:, held], self.known_trim)
        return times_vector(loop.B, self.ahead + times_vector(loop.K, self.known_trim)) - off

    def commands(self, state: FloatArray, reference: FloatArray) -> FloatArray:
        """Commands v (P, m) at states (P, n) and references (P, p)."""
        return self.ahead + times_vector(self.loop.N, reference) - times_vector(self.loop.K, state - self.known_trim)


class Course:
    """What the closed loop is at any instant of a flight.

    Attributes
    ----------
    loop : of the design, over its grid

    Raises
    ------
    ValueError : a controller that cannot be flown over a profile, in words
    """

    def __init__(
        self, study: Study, plant: PlantEnvelope, designed: DesignedController, profile: FlightProfile,
        trim: ControllerTrim,
    ) -> None:  # fmt: skip
        self.loop = _flyable(study, plant, designed)
        self.study, self.plant, self.designed, self.profile = study, plant, designed, profile
        self._trim = trim
        self._first: tuple[FloatArray, FloatArray] | None = None
        if trim == "held":
            first = self.at(np.zeros(1))
            self._first = first.plant.model.state_offset[0], first.plant.model.input_offset[0]

    def at(self, time: FloatArray) -> Instants:
        """The loop at times (P,) [s].

        Raises
        ------
        ProfileRefused : the section has no model there
        ValueError : the schedule has no gains there
        """
        condition = self.profile.condition(time)
        model, plant = self._linearised(time, condition)
        place = coordinates(self.plant.grid.axes, condition)
        gains, clipped = self._tables(self.designed.gains, place)
        self._refuse_missing(gains, time)
        loop = self._loop(model, gains, place)
        states, inputs = self._known(model, place)
        own = _over_states(model.states, model.state_offset, model.input_offset, loop.states)
        known = _over_states(model.states, states, inputs, loop.states)
        if loop.inputs == ("tab",):
            deflection = isinstance(self.designed.request, ClassicalController) and (
                self.designed.request.tab_command == "deflection"
            )
            at = model.states.index("dt")
            ahead = (states - model.state_offset)[:, [at]] * float(deflection)
        else:
            ahead = inputs - model.input_offset
        return Instants(condition, plant, loop, gains, clipped, own, known, ahead)

    def _linearised(self, time: FloatArray, condition: FlightCondition) -> tuple[LinearModel, NonlinearPlant]:
        """Linear model and what is beyond it (P,)."""
        system, request = self.plant.system, self.study.trim
        outside = ~system.aerodynamics.covers(condition.mach)
        if outside.any():
            mach = condition.mach[outside][0]
            raise _left(time, outside, f"Mach {mach:.4g} is outside the subsonic model (Mach < 1)")
        found = trim(system, condition, request)
        if not found.reached.all():
            raise _left(time, ~found.reached, str(found.reason[~found.reached][0]))
        source = system.aerodynamics.source
        unknown = ~source.covers(found.alpha, found.state[:, 0], found.state[:, 2])
        if unknown.any():
            raise _left(time, unknown, f"the trim lies outside the hinge-moment data: {source.domain}")
        model = linearise(system, condition, found)
        return model, NonlinearPlant.of(system, condition, found, model)

    def _tables(self, gains: tuple[Gain, ...], place: tuple[FloatArray, ...]) -> tuple[tuple[Gain, ...], BoolArray]:
        """Tables (*G,) between the grid points, as the gains of a schedule are."""
        request = self.designed.request
        table = GainSchedule(
            request.name, request.kind, self.plant.grid.axes, gains, self.designed.outcomes, "", _NOWHERE
        )
        found = interpolate(table, place)
        return found.gains, found.clipped

    def _matrix(self, table: FloatArray, place: tuple[FloatArray, ...]) -> FloatArray:
        """Tables (*G, ...) between the grid points, (P, ...)."""
        grid = self.plant.grid.shape
        flat = table.reshape(*grid, -1)
        each = tuple(Gain(str(i), "1", flat[..., i]) for i in range(flat.shape[-1]))
        found = [gain.values for gain in self._tables(each, place)[0]]
        shape = table.shape[len(grid) :]
        return np.stack(found, axis=-1).reshape(-1, *shape) if found else np.zeros((len(place[0]), *shape))

    def _loop(self, model: LinearModel, gains: tuple[Gain, ...], place: tuple[FloatArray, ...]) -> Loop:
        """The loop of the schedule's gains around the model."""
        designed, request, study = self.designed, self.designed.request, self.study
        if isinstance(request, ClassicalController):
            # Of the servo tab's own gain the loop takes the sign only, and that is the design's.
            sign = np.nanmax(self.plant.servo_tab.dc_gain[designed.outcomes.ok])
            servo = replace(servo_tab(model), dc_gain=np.full(len(place[0]), sign))
            return tab_loop(model, servo, study.tab_actuator, request, {gain.name: gain.values for gain in gains})
        optimum = designed.optimum
        structure = request.structure(study.tab_actuator, study.aileron_actuator)
        if optimum is not None:
            structure = optimum.structure
        K = self.loop.K if optimum is None else optimum.K
        flown = flown_loop(model, structure, self._matrix(K, place), self._matrix(self.loop.N, place))
        measured = request.measurement
        return with_rate_filters(flown, measured.cutoff) if isinstance(measured, RateFilters) else flown

    def _known(self, model: LinearModel, place: tuple[FloatArray, ...]) -> tuple[FloatArray, FloatArray]:
        """Trim states (P, n) and torques (P, 2) that the controller works from."""
        if self._first is not None:
            return np.broadcast_to(self._first[0], model.state_offset.shape), np.broadcast_to(
                self._first[1], model.input_offset.shape
            )
        if self._trim != "scheduled":
            return model.state_offset, model.input_offset
        of = self.plant.model
        return self._matrix(of.state_offset, place), self._matrix(of.input_offset, place)

    def _refuse_missing(self, gains: tuple[Gain, ...], time: FloatArray) -> None:
        missing = np.any([np.isnan(gain.values) for gain in gains], axis=0)
        if missing.any():
            raise ValueError(
                f"the schedule of controller {self.designed.request.name} has no gains at {time[missing][0]:.6g} s of "
                "the profile: a grid point that carries weight there has none"
            )


def _over_states(
    names: tuple[str, ...], model_states: FloatArray, torques: FloatArray, states: tuple[str, ...]
) -> FloatArray:
    """A trim (P, n) over the states of a loop, from those of the model (P, n_model) and the torques (P, 2)."""
    of = {"tab_torque": torques[:, 0], "aileron_torque": torques[:, 1]}
    of |= dict.fromkeys(INTEGRALS, np.zeros(len(torques)))
    of |= {name: model_states[:, i] for i, name in enumerate(names)}
    return np.stack([of[name.removesuffix("_filtered")] for name in states], axis=-1)


def _flyable(study: Study, plant: PlantEnvelope, designed: DesignedController) -> Loop:
    """The loop of a controller that can be flown over a profile.

    Raises
    ------
    ValueError
    """
    request, loop, why = designed.request, designed.loop, None
    if not isinstance(loop, Loop) or request.sampling is not None:
        why = "runs on a computer: over a profile only controllers in continuous time are flown"
    elif designed.observer is not None:
        why = "works from estimates by a model of each grid point: over a profile it has none"
    elif any(loop.delay):
        why = "has transport delays: over a profile only loops without are flown"
    elif "dt" not in loop.states:
        why = "moves an ideal tab at any rate: give the servo a bandwidth to fly it over a profile"
    elif not designed.outcomes.ok.any():
        why = "has no gains at any grid point"
    elif isinstance(request, ClassicalController):
        signs = np.sign(plant.servo_tab.dc_gain[designed.outcomes.ok])
        if np.any(signs != signs[0]):
            why = "has laws of different signs at its grid points: there are no gains between them"
    if why is not None or not isinstance(loop, Loop):
        raise ValueError(f"controller {request.name} {why}")
    return loop


def _left(time: FloatArray, where: BoolArray, why: str) -> ProfileRefused:
    return ProfileRefused(f"at {time[where][0]:.6g} s the profile leaves the model: {why}")


def times_vector(matrix: FloatArray, vector: FloatArray) -> FloatArray:
    """Matrices (P, i, j) by vectors (P, j), (P, i)."""
    return np.asarray((matrix @ vector[..., None])[..., 0])
