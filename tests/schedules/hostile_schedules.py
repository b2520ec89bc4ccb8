"""Schedules whose texts try to break out of every language that a file is written in, and gains with long names."""

from dataclasses import replace

import numpy as np

from design.gains import Gain

#: Ends and begins comments, strings, markup and lines in C, MATLAB, XML and DAVE-ML.
TEXT = "u = -K [x, 'y'] */ /* \"q\" */*/ ??/ ??' --> -- <!-- ]]> &amp; <x> % {c} \\ %d \n # Fl\u00fcgel \u2028 \x00 -"

#: Names as state feedback with an estimator or with sampling has them.
NAMES = {
    "K_T_t_T_t_1": "1",
    "L_dt_rate_da": "1/s",
    "A_dt_rate_dt": "1/s^2",
    "B_da_rate_T_a": "rad/(N m s^2)",
    "K_T_a_int_a": "N m/(rad s)",
}


def hostile(schedule):
    """The schedule with `TEXT` as law, reasons and names of design and controller, and the gains of `NAMES`."""
    rng = np.random.default_rng(1)
    ok = schedule.outcomes.ok
    gains = tuple(Gain(n, u, np.where(ok, rng.standard_normal(ok.shape), np.nan)) for n, u in NAMES.items())
    reasons = np.where(ok, None, TEXT)
    return replace(
        schedule,
        kind="lqr",
        controller="rate-loop_2",
        law=TEXT,
        gains=gains,
        provenance=replace(schedule.provenance, design_name=TEXT, design_id=TEXT, request_digest=TEXT),
        outcomes=replace(schedule.outcomes, reasons=reasons),
    )


def points_around(schedule, count=40, seed=3):
    """(count, number of axes) conditions inside and outside the grid, the nodes of its corners among them."""
    rng = np.random.default_rng(seed)
    edges = np.array([(a.values[0], a.values[-1]) for a in schedule.axes])
    span = np.maximum(edges[:, 1] - edges[:, 0], 1.0)
    points = rng.uniform(edges[:, 0] - 0.3 * span, edges[:, 1] + 0.3 * span, (count, len(edges)))
    return np.vstack([edges[:, 0], edges[:, 1], points])
