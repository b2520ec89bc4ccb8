"""Requests for weights on the wind-tunnel example, and an exact judgement that shares nothing with the search."""

import numpy as np

from design.assess import achieved, assess
from design.lqr.controller import LqrController
from design.lqr.flown import flown_loop
from design.lqr.power_figures import power_figures
from design.lqr.power_weights import ReferenceStep
from design.lqr.riccati import solve_riccati
from design.lqr.structures import Structure
from design.lqr.tracking import augment_with_integral, feed_forward, steady_state
from design.lqr.weight_request import SIX, WeightSearch
from design.specs import Spec
from tests.design.lqr_cases import WIND_TUNNEL_WEIGHTS, example

STEP = ReferenceStep(np.deg2rad(10.0), 1.0)
SPECS = (
    Spec("settling_time", "max", 0.2),
    Spec("overshoot", "max", 0.05),
    Spec("damping_ratio", "min", 0.5),
    Spec("aileron_torque", "max", 4.0),
    Spec("tab_rate", "max", 40.0),
)
MODEL = example("wind_tunnel")[0]


def request(specs=SPECS, **options):
    options = {"controller": LqrController("sought", WIND_TUNNEL_WEIGHTS), "step": STEP, **options}
    return WeightSearch(specs=specs, **options)


def exact(model, search, z, structure=None):
    """Values of the specs (M, s), and what is minimised (M,), of weights z (M, J) at the point of a model (1)."""
    structure = structure or Structure()
    repeated = model.take(np.zeros(len(z), dtype=int))
    plant = augment_with_integral(repeated, structure)
    values = dict(zip(search.names, search.maxima(z).T, strict=True))
    order = {
        "dt": "tab",
        "dt_rate": "tab_rate",
        "da": "aileron",
        "da_rate": "aileron_rate",
        "int_a": "aileron_integral",
    }
    Q = np.zeros((len(z), len(plant.states), len(plant.states)))
    for i, state in enumerate(plant.states):
        if state in order:
            Q[:, i, i] = values[order[state]] ** -2.0
    R = np.zeros((len(z), 2, 2))
    R[:, 0, 0], R[:, 1, 1] = values["tab_torque"] ** -2.0, values["aileron_torque"] ** -2.0
    solution = solve_riccati(plant.A, plant.B, Q, R)
    ok = solution.certified
    K = solution.K[ok]
    N = feed_forward(K, steady_state(repeated.take(ok), "zero_aileron_torque", structure))
    loop = flown_loop(repeated.take(ok), structure, K, N)
    assessment = assess(loop, np.array([search.step.aileron]), search.step.duration, samples=2)
    tab, aileron = assessment.demand
    found, least = np.full((len(z), len(search.specs)), np.nan), np.full(len(z), np.nan)
    for k, spec in enumerate(search.specs):
        found[ok, k] = achieved(assessment, spec.quantity)
    least[ok] = {
        "total_rms_power": lambda: tab.rms_power + aileron.rms_power,
        "peak_aileron_torque": lambda: aileron.peak_torque,
        "peak_total_power": lambda: power_figures(loop, search.step).total,
        "energy_out": lambda: tab.energy_out + aileron.energy_out,
    }[search.minimised]()
    return found, least


def met(search, values, tolerance=1e-9):
    """Mask (M,) of values (M, s) that meet all specs."""
    each = [spec.met(values[:, k], tolerance) for k, spec in enumerate(search.specs)]
    return np.all(each, axis=0)


def scattered(random, count, span=100.0, about=None, spread=None):
    """Random weights (M, J): anywhere, or about a place."""
    high = np.log(span)
    z = random.uniform(-high, high, (count, len(SIX)))
    return z if about is None else np.clip(about + spread * random.normal(size=z.shape), -high, high)


def unknowns(search, maxima):
    """z (..., J) of largest acceptable values (..., names)."""
    start = np.array([getattr(search.start, name) for name in search.searched])
    return np.log(maxima[..., [search.names.index(name) for name in search.searched]] / start)
