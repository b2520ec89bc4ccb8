"""A designed envelope: the study, its plant, and each controller with its gains, its loop and what is said of it."""

from __future__ import annotations

from dataclasses import dataclass

from design.assess import Assessment
from design.estimation.kalman_filter import KalmanFilter
from design.gains import Gain
from design.loop import Loop
from design.lqr.coded_loop import CodedLoop
from design.lqr.sampled_design import SampledLqrDesign
from design.lqr.synthesis import LqrDesign
from design.lqr.weights import WeightsRefused
from design.outcome import Outcomes
from design.specs import Verdict
from model.arrays import ComplexArray, FloatArray, ObjectArray
from schedules.analysis import EnvelopeWarning, PlantEnvelope
from schedules.smoothed import Smoothed
from schedules.study import Controller, Study


@dataclass(frozen=True, eq=False)
class DesignedController:
    """One controller over the grid: gains with their outcomes, the loop that is flown, and what is said of it.

    Attributes
    ----------
    request : what was asked for
    outcomes : (*G,)
    gains : each (*G,), nan where the outcome is not ok
    loop : over the whole grid, nan where the outcome is not ok; of a digital controller the continuous loop that lags
        as much, of a sampled state feedback the loop as it is coded
    assessment : over the whole grid, nan where the outcome is not ok; None when no point is
    fastest_mode : (*G,) fastest closed-loop mode of the surfaces that the air moves (`design.frequency.fastest_mode`)
        [rad/s]: both of them with state feedback, the aileron where the tab's position is imposed; nan where the
        outcome is not ok
    reduced_frequency : (*G,) k of that mode [-]
    verdicts : one per spec
    optimum : solution and certificate of the LQR; None for classical controllers
    observer : Kalman filter whose estimates a state feedback reads; None elsewhere
    infeasibility : (*G,) why a classical design has no gains (`design.classical.infeasibility.Infeasibility`), None
        elsewhere; None for other controllers
    smoothed : what was given up for gains that vary smoothly; None where nothing was asked for
    """

    request: Controller
    outcomes: Outcomes
    gains: tuple[Gain, ...]
    loop: Loop | CodedLoop
    assessment: Assessment | None
    fastest_mode: ComplexArray
    reduced_frequency: FloatArray
    verdicts: tuple[Verdict, ...]
    optimum: LqrDesign | SampledLqrDesign | None = None
    observer: KalmanFilter | None = None
    infeasibility: ObjectArray | None = None
    smoothed: Smoothed | None = None


@dataclass(frozen=True, eq=False)
class DesignedEnvelope:
    """A study, its plant and its controllers, over the grid."""

    study: Study
    plant: PlantEnvelope
    controllers: tuple[DesignedController, ...]
    warnings: tuple[EnvelopeWarning, ...]

    def controller(self, name: str) -> DesignedController:
        """The controller of this name; KeyError when there is none."""
        for controller in self.controllers:
            if controller.request.name == name:
                return controller
        raise KeyError(name)


class ControllerRefused(ValueError):
    """A controller that cannot work at any point of the grid.

    Attributes
    ----------
    controller : its name
    refused : what its weights lack
    """

    def __init__(self, controller: str, refused: WeightsRefused) -> None:
        super().__init__(f"controller {controller}: {refused}")
        self.controller = controller
        self.refused = refused

    def __reduce__(self) -> tuple[type[ControllerRefused], tuple[str, WeightsRefused]]:
        """Made again from what it was made of: so that it comes back from another process."""
        return ControllerRefused, (self.controller, self.refused)
