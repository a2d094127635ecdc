"""From motion to volts: the laser vibrometer that watches m0 and the accelerometer on the base."""

import numpy as np
from numpy.typing import NDArray

from vibench.acquisition import ConfigurationError
from vibench.acquisition.rig import AccelerometerConfig, VibrometerConfig

from ._analogue_filter import RunningFilter, first_order, resonant
from ._disturbance import Disturbance, RandomDropouts, overwrite
from ._noise import NoiseStream
from ._time_grid import USUAL_GRID, TimeGrid

FloatArray = NDArray[np.float64]

ACCELEROMETER_DAMPING_RATIO = 0.02
"""Of a piezoelectric accelerometer's mounted resonance; assumed, usual for the kind."""
IEPE_BIAS_V = 10.0
"""Constant voltage of a powered IEPE sensor; 8 to 12 V is usual."""
LONGEST_DELAY_S = 5e-3
"""Of a sensor: what the converter keeps for the beginning of a conversion at its lowest rate."""


class Vibrometer:
    """A laser vibrometer with its velocity decoder.

    Velocity, the decoder's bandwidth (first order), white noise, dropouts, volts, clipping at full
    scale, in this order. What is left of the decoder's delay, beyond that of its bandwidth, is a
    plain delay (``delay_steps``), which the converter's filter applies exactly.
    """

    def __init__(
        self,
        config: VibrometerConfig,
        noise_density: float,
        dropouts: RandomDropouts,
        noise: NoiseStream,
        grid: TimeGrid = USUAL_GRID,
    ) -> None:
        """``noise_density`` in (m/s)/sqrt(Hz)."""
        if config.delay_s > LONGEST_DELAY_S:
            raise ConfigurationError(
                f"vibrometer.delay_s = {config.delay_s} s: the virtual rig can delay by at most "
                f"{LONGEST_DELAY_S} s; give a smaller delay"
            )
        bandwidth = first_order(config.bandwidth_hz)
        self.delay_steps = (config.delay_s - bandwidth.delay_s) * grid.rate_hz
        self.over_range_steps = 0
        """Steps at full scale since the instrument was switched on: what its red lamp shows."""
        self._filter = RunningFilter(bandwidth, grid.step_s)
        self._noise_rms = noise_density * np.sqrt(grid.rate_hz / 2)
        self._full_scale_m_per_s = config.full_scale_m_per_s
        self._full_scale_v = config.full_scale_v
        self._noise = noise
        self._dropouts = dropouts
        self._demanded: list[Disturbance] = []

    def disturb(self, disturbance: Disturbance) -> None:
        """Show a level instead of the velocity for some steps: a dropout or an over-range on demand."""
        self._demanded.append(disturbance)

    def show(self, velocity: FloatArray, first_step: int) -> FloatArray:
        """Output volts for the means of the velocity [m/s] over the next steps, shape (steps,)."""
        stop = first_step + len(velocity)
        seen = self._filter.run(velocity)
        seen += self._noise_rms * self._noise.draw(first_step, len(velocity))
        self._demanded = [one for one in self._demanded if one.stop_step > first_step]
        overwrite(
            seen,
            first_step,
            self._full_scale_m_per_s,
            self._dropouts.between(first_step, stop) + self._demanded,
        )
        full = np.abs(seen) >= self._full_scale_m_per_s
        self.over_range_steps += int(np.count_nonzero(full))
        volts = seen * (self._full_scale_v / self._full_scale_m_per_s)
        return np.clip(volts, -self._full_scale_v, self._full_scale_v)


class Accelerometer:
    """A piezoelectric accelerometer: its resonance, noise, sensitivity, and clipping at full scale."""

    def __init__(
        self,
        config: AccelerometerConfig,
        noise_m_per_s2: float,
        noise: NoiseStream,
        grid: TimeGrid = USUAL_GRID,
    ) -> None:
        """``noise_m_per_s2``: rms in ``FULL_BAND_HZ``."""
        mounted = resonant(config.resonance_hz, ACCELEROMETER_DAMPING_RATIO)
        self._filter = RunningFilter(mounted, grid.step_s)
        self._noise_rms = grid.rms_per_step(noise_m_per_s2)
        self._sensitivity = config.sensitivity_v_per_m_per_s2
        self._full_scale_v = config.full_scale_v
        self._noise = noise

    def show(self, acceleration: FloatArray, first_step: int) -> FloatArray:
        """Output volts, without bias, for the means of the acceleration [m/s2], shape (steps,)."""
        seen = self._filter.run(acceleration)
        seen += self._noise_rms * self._noise.draw(first_step, len(acceleration))
        return np.clip(seen * self._sensitivity, -self._full_scale_v, self._full_scale_v)
