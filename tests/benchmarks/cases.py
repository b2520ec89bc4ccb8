"""What is compared: data set A over 25 flight conditions with the LQR of the shipped example, five states."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from design.classical.controller import ClassicalController
from design.loop import Loop
from design.lqr.synthesis import LqrController, design_lqr
from design.lqr.torque_loop import lqr_loop
from design.lqr.tracking import TrackingPlant, augment_with_integral
from design.lqr.weights import BrysonWeights, ExplicitWeights, weight_matrices
from design.specs import Spec
from model.actuators import Actuator
from model.examples import WIND_TUNNEL_TRIM, wind_tunnel
from schedules.analysis import PlantEnvelope, analyse
from schedules.study import GridRequest, Reference, Study

#: Gains of a root locus, samples of a step, length of the step [s] and its size [rad].
GAINS, SAMPLES, DURATION = 300, 501, 1.0
STEP = float(np.deg2rad(10.0))
#: The tab's actuator of the wind-tunnel examples.
TAB_ACTUATOR = Actuator(2.0 * np.pi * 40.0, 0.7, 2.0 * np.pi * 80.0)


@dataclass(frozen=True, eq=False)
class Case:
    """25 points, flat: study, plant, augmented plant, weights and the designed loop."""

    study: Study
    plant: PlantEnvelope
    tracking: TrackingPlant
    weights: ExplicitWeights
    loop: Loop


def study() -> Study:
    """Five altitudes to 6000 m by five dynamic pressures, one LQR."""
    system = wind_tunnel()
    weights = BrysonWeights(
        aileron=np.deg2rad(2.0), aileron_rate=np.deg2rad(200.0), tab=np.deg2rad(10.0), tab_rate=np.deg2rad(400.0),
        aileron_integral=np.deg2rad(0.1), tab_torque=0.5, aileron_torque=2.0,
    )  # fmt: skip
    grid = GridRequest(
        tuple(np.linspace(0.0, 6000.0, 5).tolist()), "dynamic_pressure", tuple(np.geomspace(245.0, 1531.25, 5).tolist())
    )
    return Study(
        geometry=system.geometry, inertia=system.inertia, aerodynamics=system.aerodynamics, trim=WIND_TUNNEL_TRIM,
        grid=grid, name="bench", tab_actuator=Actuator(), aileron_actuator=Actuator(),
        reference=Reference(STEP, DURATION), controllers=(LqrController("lqr", weights),),
    )  # fmt: skip


def tab_only() -> tuple[ClassicalController, ...]:
    """The tab-only controllers of the example, by both commands of the tab's actuator."""
    specs = (
        Spec("damping_ratio", "min", 0.5), Spec("gain_margin", "min", 6.0), Spec("phase_margin", "min", np.pi / 4),
        Spec("settling_time", "max", 0.6), Spec("overshoot", "max", 0.2),
    )  # fmt: skip
    nf = ClassicalController("nf", "negative_feedback", specs, 2.0 * np.pi * 100.0)
    pf = ClassicalController("pf", "positive_feedback", (Spec("damping_ratio", "min", 0.4),))
    by_rate = tuple(replace(c, name=f"{c.name} by rate", tab_command="rate") for c in (nf, pf))
    return nf, pf, *by_rate


@cache
def case() -> Case:
    """The study, designed once, with the grid's two axes made one."""
    asked = study()
    controller = asked.controllers[0]
    assert isinstance(controller, LqrController)
    plant = analyse(asked)
    everywhere = np.ones(plant.grid.shape, dtype=bool)
    model = plant.model.take(everywhere)
    loop = lqr_loop(model, design_lqr(model, controller))
    return Case(asked, plant, augment_with_integral(model), weight_matrices(controller.weights), loop)
