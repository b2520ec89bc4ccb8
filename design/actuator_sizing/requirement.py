"""What an actuator must do at its surface, point by point: peaks, means, a cloud of torques and rates, and loads."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from model.arrays import FloatArray, GridArrays


@dataclass(frozen=True, eq=False)
class SurfaceRequirement(GridArrays):
    """Requirements on one actuator, at the surface, without the actuator's own rotor. All torques are totals.

    Points that carry nan ask for nothing there; inf cannot be met.

    Attributes
    ----------
    peak_torque, rms_torque : (*G,) [N m]
    peak_rate : (*G,) [rad/s]
    peak_power : (*G,) [W]
    peak_acceleration, rms_acceleration : (*G,) of the surface [rad/s^2], for the rotor's inertia
    torque, rate, acceleration : (*G, S) asked for at the same time [N m], [rad/s], [rad/s^2]; S may be 0
    static_torque : (*G, L) loads that are held at rest [N m] (`design.actuator_sizing.load_cases`); L may be 0
    """

    peak_torque: FloatArray
    rms_torque: FloatArray
    peak_rate: FloatArray
    peak_power: FloatArray
    peak_acceleration: FloatArray
    rms_acceleration: FloatArray
    torque: FloatArray
    rate: FloatArray
    acceleration: FloatArray
    static_torque: FloatArray

    def __post_init__(self) -> None:
        super().__post_init__()
        grid = self.peak_torque.shape
        peaks = (self.rms_torque, self.peak_rate, self.peak_power, self.peak_acceleration, self.rms_acceleration)
        cloud = {self.torque.shape, self.rate.shape, self.acceleration.shape}
        rows = (self.torque.shape[:-1], self.static_torque.shape[:-1])
        if any(each.shape != grid for each in peaks) or len(cloud) != 1 or any(each != grid for each in rows):
            raise ValueError("a requirement needs peaks (*G,), one cloud (*G, S) and loads (*G, L) over one grid")

    @classmethod
    def of_samples(
        cls,
        torque: FloatArray,
        rate: FloatArray,
        acceleration: FloatArray | None = None,
        weight: FloatArray | None = None,
        static_torque: FloatArray | None = None,
    ) -> Self:
        """Requirements that samples of responses make, peaks being those of the samples.

        Parameters
        ----------
        torque, rate : (*G, S) at the same time, S at least 1 [N m], [rad/s]
        acceleration : (*G, S) [rad/s^2]; 0 when left out, which only a rotor without inertia deserves
        weight : (*G, S) share of the time that each sample stands for, in any unit; all the same when left out
        static_torque : (*G, L) [N m]; none when left out

        Raises
        ------
        ValueError : arrays that do not fit, or weights that are negative or all zero
        """
        torque, rate = np.asarray(torque, dtype=float), np.asarray(rate, dtype=float)
        if torque.shape != rate.shape or torque.ndim == 0 or torque.shape[-1] == 0:
            raise ValueError(f"torque and rate must be (*G, S), are {torque.shape} and {rate.shape}")
        bends = np.zeros(torque.shape) if acceleration is None else np.asarray(acceleration, dtype=float)
        shares = np.ones(torque.shape) if weight is None else np.asarray(weight, dtype=float)
        if bends.shape != torque.shape or shares.shape != torque.shape:
            raise ValueError(f"accelerations and weights must be {torque.shape}")
        whole = shares.sum(axis=-1)
        if np.any(shares < 0.0) or not np.all(whole > 0.0):
            raise ValueError("weights must not be negative, nor all zero")
        held = np.zeros((*torque.shape[:-1], 0)) if static_torque is None else np.asarray(static_torque, dtype=float)

        def rms(values: FloatArray) -> FloatArray:
            return np.asarray(np.sqrt((shares * values**2).sum(axis=-1) / whole))

        peak_torque, peak_rate, peak_power, peak_acceleration = (
            np.abs(values).max(axis=-1) for values in (torque, rate, torque * rate, bends)
        )
        return cls(
            peak_torque, rms(torque), peak_rate, peak_power, peak_acceleration, rms(bends), torque, rate, bends, held
        )
