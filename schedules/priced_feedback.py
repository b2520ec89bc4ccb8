"""A state feedback whose actuator costs more at some points: its design and its step with weights that are raised."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.delay.characteristic import finite_points
from design.delay.step_response import delayed_step_response
from design.delay.with_pade import without_delay
from design.estimation.filter_gains import filter_gains
from design.estimation.kalman_filter import kalman_filter
from design.estimation.observer import with_kalman_filter
from design.estimation.rate_filters import with_rate_filters
from design.frequency.poles import poles
from design.gains import Gain
from design.loop import Loop
from design.lqr.controller import LqrController
from design.lqr.cost import Cost, cost_of
from design.lqr.flown import flown_loop
from design.lqr.measurement import KalmanMeasurement, RateFilters
from design.lqr.retuning import scaled_cost
from design.lqr.return_difference import return_difference
from design.lqr.riccati import RiccatiSolution, solve_riccati
from design.lqr.synthesis import LqrDesign
from design.lqr.torque_loop import gains as named_gains
from design.lqr.tracking import SteadyState, TrackingPlant, augment_with_integral, feed_forward, steady_state
from design.outcome import Outcome, Outcomes
from design.response.demand import ActuatorDemand, actuator_demand
from design.response.final_value import decaying
from design.response.manoeuvre_demand import manoeuvre_demands
from design.response.manoeuvre_response import manoeuvre_response
from design.response.step_metrics import step_metrics
from model.actuators import ActuatorLimits
from model.arrays import BoolArray, FloatArray, IntArray
from model.linear_model import LinearModel
from schedules.actuator_limits import Limited
from schedules.analysis import PlantEnvelope
from schedules.designed import DesignedController
from schedules.judging import horizon
from schedules.rotor_inertia import SURFACES
from schedules.state_feedback import StateFeedback, noise_of
from schedules.study import Reference, Study

#: Families of weights; of what is as designed the number is -1.
FAMILIES = ("torque", "torque_and_rate")
#: How many responses are held at once.
PART = 1000


@dataclass(frozen=True, eq=False)
class PricedFeedback:
    """The points (N,) of a design, and what it costs there."""

    model: LinearModel
    plant: TrackingPlant
    rest: SteadyState
    cost: Cost
    request: LqrController
    limited: Limited
    step: FloatArray
    duration: float
    reference: Reference

    @classmethod
    def of(cls, study: Study, plant: PlantEnvelope, designed: DesignedController, limited: Limited) -> PricedFeedback:
        """The points that carry a design, at the cost that it minimises."""
        request, optimum, ok = designed.request, designed.optimum, designed.outcomes.ok
        assert isinstance(request, LqrController)
        assert isinstance(optimum, LqrDesign)
        structure = request.structure(study.tab_actuator, study.aileron_actuator)
        model = plant.model.take(ok)
        tracking = augment_with_integral(model, structure)
        cost = cost_of(request.weights, augment_with_integral(plant.model, structure)).at(ok)
        if optimum.retuning is not None:
            found = optimum.retuning.take(ok)
            cost = scaled_cost(cost, tracking, np.stack([found.tab, found.aileron, found.integrals], axis=-1))
        rest = steady_state(model, request.tab_allocation, structure)
        step = study.reference.sizes(structure.references)
        return cls(model, tracking, rest, cost, request, limited, step, horizon(study, request), study.reference)

    @property
    def size(self) -> int:
        """How many points there are."""
        return int(self.model.A.shape[0])

    def peaks(self, family: int, factors: FloatArray, points: IntArray) -> FloatArray:
        """Peaks (M, k) of what is limited at points (M,) with factors (M,); nan where there is no stable loop."""
        families = np.full(points.size, family)
        slices = [slice(first, first + PART) for first in range(0, points.size, PART)]
        return np.concatenate([self._part(families[at], factors[at], points[at]) for at in slices])

    def _part(self, families: IntArray, factors: FloatArray, points: IntArray) -> FloatArray:
        loop, _, _ = self._flown(self._solved(families, factors, points), points)
        stable = finite_points(loop)
        stable[stable] = decaying(poles(without_delay(loop.take(stable)).closed)).all(axis=-1)
        peaks = np.full((points.size, len(self.limited.names)), np.nan)
        if np.any(stable):
            some = loop.take(stable)
            peaks[stable] = self.limited.peaks(self._demand(some))
        return peaks

    def _demand(self, loop: Loop) -> ActuatorDemand:
        """What stable loops ask of the actuator for the reference, as designs are judged (`schedules.judging`)."""
        actuator = self.limited.actuator
        if self.reference.rate_limit is None:
            response = delayed_step_response(loop, self.step, self.duration, 2)
            return actuator_demand(without_delay(loop), response, actuator)
        manoeuvre = self.reference.manoeuvre(loop.references)
        flown = manoeuvre_response(loop, manoeuvre, self.reference.duration, 2)
        return manoeuvre_demands(loop, flown, (actuator,), (ActuatorLimits(),))[0]

    def settling(self, family: int, factors: FloatArray, points: IntArray) -> FloatArray:
        """Settling times (P,) [s] of designs whose loops are stable; nan where they do not settle in time."""
        loop, _, _ = self._flown(self._solved(np.full(points.size, family), factors, points), points)
        response = delayed_step_response(loop, self.step, self.duration, 2)
        return step_metrics(without_delay(loop), response, "da", self.step).settling_time

    def _cost(self, families: IntArray, factors: FloatArray, points: IntArray) -> Cost:
        """The cost at points (M,), that of the actuator raised by factors (M,)."""
        i = SURFACES[self.limited.actuator]
        root = np.sqrt(factors)
        u, x = np.ones((points.size, 2)), np.ones((points.size, len(self.plant.states)))
        u[:, i] = root
        x[:, self.plant.states.index(("dt_rate", "da_rate")[i])] = np.where(families == 1, root, 1.0)
        return self.cost.at(points).scaled(x, u)

    def _solved(self, families: IntArray, factors: FloatArray, points: IntArray) -> RiccatiSolution:
        cost = self._cost(families, factors, points)
        return solve_riccati(self.plant.A[points], self.plant.B[points], cost.Q, cost.R, cost.N)

    def _flown(self, solution: RiccatiSolution, points: IntArray) -> tuple[Loop, tuple[Gain, ...], Outcomes]:
        """The loop as it measures its states, the gains that this adds, and what became of the points."""
        K, rest = solution.K, self.rest.take(points)
        loop = flown_loop(self.model.take(points), self.plant.structure, K, feed_forward(K, rest))
        outcomes = Outcomes.all_ok(points.shape).failing(
            ~solution.certified, Outcome.NOT_CERTIFIED, lambda _: "no certified solution of the Riccati equation"
        )
        measured = self.request.measurement
        if isinstance(measured, RateFilters):
            return with_rate_filters(loop, measured.cutoff), (), outcomes
        if isinstance(measured, KalmanMeasurement):
            estimator = kalman_filter(loop, noise_of(measured), outcomes)
            return with_kalman_filter(loop, estimator), filter_gains(loop, estimator), estimator.outcomes
        return loop, (), outcomes

    def feedback(self, families: IntArray, factors: FloatArray, points: IntArray, where: BoolArray) -> StateFeedback:
        """The state feedback of points (M,), those of a mask (*G,), over the grid, not yet judged."""
        solution, cost = self._solved(families, factors, points), self._cost(families, factors, points)
        loop, more, outcomes = self._flown(solution, points)
        values, vectors = np.linalg.eigh(cost.R)
        root, inverse = ((vectors * values[:, None, :] ** power) @ vectors.mT for power in (0.5, -0.5))
        plant = self.plant.take(points)
        certified = solution.certified
        difference = np.full(points.shape, np.nan)
        difference[certified] = return_difference(
            plant.A[certified], (plant.B @ inverse)[certified], (root @ solution.K)[certified], np.eye(2)
        ).smallest
        design = LqrDesign(
            K=solution.K, N=feed_forward(solution.K, self.rest.take(points)), X=solution.X,
            residual=np.where(certified, solution.residual, np.nan), largest_real_part=solution.largest_real_part,
            return_difference_min=difference, outcomes=outcomes, retuning=None, states=self.plant.states,
            structure=self.plant.structure,
        )  # fmt: skip
        ok = outcomes.ok
        named = tuple(
            Gain(gain.name, gain.unit, np.where(ok, gain.values, np.nan)) for gain in (*named_gains(design), *more)
        )
        over_grid = tuple(Gain(gain.name, gain.unit, _spread(gain.values, where)) for gain in named)
        kept = loop.take(ok)
        mask = where.copy()
        mask[where] = ok
        return StateFeedback(outcomes.spread(where), over_grid, kept.spread(mask), design.spread(where))


def _spread(values: FloatArray, where: BoolArray) -> FloatArray:
    whole = np.full(where.shape, np.nan)
    whole[where] = values
    return whole
