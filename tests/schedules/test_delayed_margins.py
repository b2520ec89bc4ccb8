"""A delay makes many critical gains upwards: the one downwards, of an unstable plant, is found all the same."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from design.delay.with_pade import without_delay
from design.lqr.weights import ExplicitWeights
from model.actuators import Actuator
from schedules.run import run


def test_the_lower_gain_margin_of_a_late_unstable_plant(wind_tunnel_study):
    """The tab's cut is unstable when it is opened at these speeds, so some small gain must be critical."""
    omega = 2.0 * np.pi * 80.0
    weights = ExplicitWeights(np.diag([33.0, 0.02, 820.0, 0.08]), np.diag([4.0, 0.25]), None)
    lqr = replace(wind_tunnel_study.controllers[2], reference="none", weights=weights)
    study = replace(
        wind_tunnel_study,
        tab_actuator=replace(wind_tunnel_study.tab_actuator, torque_loop_bandwidth=omega, delay=0.001),
        aileron_actuator=Actuator(torque_loop_bandwidth=omega),
        controllers=(lqr,),
    )
    (designed,) = run(study).controllers
    tab = designed.assessment.margins[0]
    cut = without_delay(designed.loop).cut("tab")
    opened = np.linalg.eigvals(cut.A).real.max(axis=-1) > 0.0
    assert opened.any()
    assert np.all(np.isfinite(tab.gain_margin_down_db[opened]))
    for index in map(tuple, np.argwhere(opened)):
        ratio = 10.0 ** (tab.gain_margin_down_db[index] / 20.0)
        growth = [
            np.linalg.eigvals(cut.take(index).closed(np.array(k))).real.max() for k in (0.98 * ratio, 1.02 * ratio)
        ]
        assert growth[0] > 0.0 > growth[1]
