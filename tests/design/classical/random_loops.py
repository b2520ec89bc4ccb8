"""Loops drawn at random: plants, drives, structures and gains, as families with candidates."""

from __future__ import annotations

import numpy as np

from design.classical.controller import ClassicalController
from design.classical.normal_form import NormalForm
from design.classical.open_gains import OpenGains
from design.classical.steering import StepReference
from design.classical.tab_drive import TabDrive, tab_drive
from design.specs import Spec
from model.actuators import Actuator
from model.servo_tab import ServoTab

POINTS = 6


def servo_tabs(rng: np.random.Generator) -> ServoTab:
    """Second-order ailerons, well and badly damped, with a zero on either side."""
    w, z = np.exp(rng.uniform(np.log(5.0), np.log(80.0), POINTS)), np.exp(rng.uniform(np.log(0.05), 0.0, POINTS))
    gain, lead = -rng.uniform(0.3, 2.0, POINTS), rng.uniform(-0.05, 0.3, POINTS)
    F, G = np.zeros((POINTS, 2, 2)), np.zeros((POINTS, 2, 2))
    F[:, 0, 1], F[:, 1, 0], F[:, 1, 1] = 1.0, -(w**2), -2.0 * z * w
    G[:, 1, 0], G[:, 1, 1] = gain * w**2, gain * w * lead
    one = np.ones(POINTS)
    return ServoTab(
        F=F, G=G, numerator=np.stack([gain * w * lead, gain * w**2], axis=-1),
        denominator=np.stack([one, 2.0 * z * w, w**2], axis=-1), dc_gain=gain, zero=-w / lead,
        natural_frequency=w, damping_ratio=z,
    )  # fmt: skip


def drawn(seed: int) -> tuple[ServoTab, Actuator, ClassicalController, StepReference]:
    """A controller with its specs, for plants of the same size."""
    rng = np.random.default_rng(seed)
    servo = servo_tabs(rng)
    w = float(np.median(servo.natural_frequency))
    kind = rng.choice(["negative_feedback", "positive_feedback"])
    command = rng.choice(["deflection", "rate"], p=[0.7, 0.3])
    fast = w * np.exp(rng.uniform(np.log(2.0), np.log(30.0)))
    delay = 0.0 if rng.random() < 0.6 else float(rng.uniform(0.02, 0.2) / w)
    damping = float(rng.uniform(0.4, 1.2)) if command == "deflection" and rng.random() < 0.75 else None
    actuator = Actuator(fast, damping, fast, delay=delay)
    filtered = None if rng.random() < 0.3 else float(w * np.exp(rng.uniform(np.log(5.0), np.log(60.0))))
    specs = [Spec("damping_ratio", "min", float(rng.uniform(0.2, 0.6)))]
    if kind == "negative_feedback":
        specs.append(Spec("phase_margin", "min", float(rng.uniform(0.4, 1.0))))
        if rng.random() < 0.5:
            specs.append(Spec("gain_margin", "min", float(rng.uniform(3.0, 9.0))))
    if rng.random() < 0.5:
        specs.append(Spec("overshoot", "max", float(rng.uniform(0.05, 0.3))))
    controller = ClassicalController("drawn", str(kind), tuple(specs), filtered, str(command))
    return servo, actuator, controller, StepReference(0.17, 40.0 / w, rng.uniform(-0.1, 0.1, POINTS))


def family_of(servo: ServoTab, drive: TabDrive, controller: ClassicalController) -> OpenGains:
    """Loops over all gains that are not given."""
    return OpenGains.of(NormalForm.of(servo, drive, controller), tuple(controller.gain_units), controller.gains)


def drawn_family(seed: int) -> tuple[OpenGains, ClassicalController, StepReference]:
    """The loops of `drawn`."""
    servo, actuator, controller, reference = drawn(seed)
    return family_of(servo, tab_drive(actuator, controller.tab_command), controller), controller, reference


def gentle_candidates(family: OpenGains, seed: int) -> np.ndarray:
    """Unknowns (P, J) of stable loops, about halfway to what their drives allow."""
    rng, form = np.random.default_rng(seed), family.form
    lag = form.lag + 0.3
    outer = [rng.uniform(0.1, 0.5, POINTS)] if form.positive else list(rng.uniform(0.05, 0.4, (2, POINTS)) / lag)
    kappa = np.stack([*outer, 0.1 * rng.uniform(0.3, 1.0, POINTS) / lag], axis=-1)
    if form.rate_command:
        kappa = np.column_stack([0.5 / np.maximum(form.lag, 0.1), kappa])
    return family.unknowns_of(kappa)
