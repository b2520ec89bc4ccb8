"""A coded state feedback flown by brute force: the code line by line, the plant by an integrator of its equations."""

from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp

from model.arrays import FloatArray


@dataclass(frozen=True)
class Flight:
    """Dense record: times (M,), plant states (M, n) and arriving commands (M, m); both sides of every jump."""

    time: FloatArray
    states: FloatArray
    commands: FloatArray


def fly(A, B, design, T, delays, reference, samples, start=None, factor=(1.0, 1.0), dense=24) -> Flight:
    """``x' = A x + B v`` under the gains of a design at one point, from `start` with nothing commanded before.

    Parameters
    ----------
    A, B : the plant without integrals: dt dt_rate da da_rate, then torques behind a lag, then lag states
    design : K, N, states, structure
    delays : from measurement to arrival, of each input
    factor : of each command on its way to the plant
    dense : points of each stretch between two events
    """
    K, N = design.K, design.N
    names, n, m = list(design.states), len(A), B.shape[1]
    plant = [
        name for name in design.structure.states(("dt", "dt_rate", "da", "da_rate")) if not name.startswith("int_")
    ]
    integrals = [name for name in names if name.startswith("int_")]
    follows = [plant.index("da" if name == "int_a" else "dt") for name in integrals]
    K_x, K_int = K[:, [names.index(name) for name in plant]], K[:, [names.index(name) for name in integrals]]
    held = [name for name in names if name[:4] in ("T_t_", "T_a_")]
    K_held = K[:, [names.index(name) for name in held]]
    r = np.atleast_1d(np.asarray(reference, dtype=float))
    x = np.zeros(n) if start is None else np.array(start, dtype=float)
    integral, last, memory = np.zeros(len(integrals)), np.zeros(len(integrals)), dict.fromkeys(held, 0.0)
    v = np.zeros(m)
    # What was commanded before arrives too, and is nothing.
    arrivals = [(delays[i] - k * T, i, 0.0) for i in range(m) for k in range(1, int(delays[i] / T) + 1)]
    times, states, commands = [], [], []
    for k in range(samples):
        now, end = k * T, (k + 1) * T
        error = r - x[follows]
        integral = integral + 0.5 * T * (error + last)
        last = error
        u = -K_x @ x - K_int @ integral - K_held @ np.array([memory[name] for name in held]) + N @ r
        for name in reversed(held):
            age = int(name[4:])
            memory[name] = u["ta".index(name[2])] if age == 1 else memory[f"{name[:4]}{age - 1}"]
        arrivals += [(now + delays[i], i, factor[i] * u[i]) for i in range(m)]
        while True:
            due = [event for event in arrivals if event[0] <= now + 1e-12]
            arrivals = [event for event in arrivals if event[0] > now + 1e-12]
            for _, i, value in due:
                v = np.where(np.arange(m) == i, value, v)
            stop = min([end, *(event[0] for event in arrivals)])
            if stop > end - 1e-12:
                stop = end
            at = np.linspace(now, stop, dense)
            run = solve_ivp(
                lambda t, y, v=v: A @ y + B @ v, (now, stop), x, t_eval=at, method="DOP853", rtol=1e-11, atol=1e-13
            )
            times.append(at)
            states.append(run.y.T)
            commands.append(np.tile(v, (dense, 1)))
            x, now = run.y[:, -1], stop
            if stop == end:
                break
    return Flight(np.concatenate(times), np.concatenate(states), np.concatenate(commands))
