"""Time grid of the analogue world."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vibench.acquisition.rig import USUAL_GRID_RATE_HZ
from vibench.sim.engine.library import Structure
from vibench.sim.engine.run import native_engine

FULL_BAND_HZ = 25_600.0
"""Bandwidth for which the rig's configuration states noise [Hz]: half the highest usual sample rate."""

PPM = 1e-6


@dataclass(frozen=True)
class TimeGrid:
    """Equal steps of rig time.

    The converter's clock counts rig time, so that samples always lie at whole numbers of steps. Physical time
    differs from rig time by the clock's error, and the equations of motion use the physical step.

    The usual grid has twice the highest usual sample rate. Every rate of an NI 9234 is an integer fraction of
    this rate, and the transition band of its anti-alias filter fits below the Nyquist frequency. A step (9.8
    us) is far shorter than the specimen's shortest period (2 ms); contacts are resolved within a step.
    """

    rate_hz: float = USUAL_GRID_RATE_HZ

    @property
    def step_s(self) -> float:
        """Length of one step in rig time [s]."""
        return 1.0 / self.rate_hz

    def physical_step_s(self, converter_clock_ppm: float) -> float:
        """Return the physical length of a step [s] if the converter clock runs fast by this error."""
        return self.step_s / (1.0 + converter_clock_ppm * PPM)

    def rms_per_step(self, rms: float) -> float:
        """Return the rms value of white noise per step, from its rms value in ``FULL_BAND_HZ``."""
        return rms * float((self.rate_hz / 2 / FULL_BAND_HZ) ** 0.5)

    def step_at(self, time_s: float) -> int:
        """Return the number of the grid point nearest to a rig time."""
        return round(time_s * self.rate_hz)


USUAL_GRID = TimeGrid()


def relative_clock_ppm(clock_ppm: float, converter_clock_ppm: float) -> float:
    """Return the clock error of another instrument relative to the converter's clock [ppm]."""
    return ((1.0 + clock_ppm * PPM) / (1.0 + converter_clock_ppm * PPM) - 1.0) / PPM


FloatArray = NDArray[np.float64]


class RecursiveFilter:
    """A recursive digital filter (direct form II, transposed), initially at rest."""

    def __init__(self, numerator: ArrayLike, denominator: ArrayLike) -> None:
        """Create a filter; the first coefficients are for the present value; that of the denominator is 1."""
        weights = [np.asarray(each, dtype=np.float64) for each in (numerator, denominator)]
        order = max(len(each) for each in weights)
        self.numerator, self.denominator = (np.pad(each, (0, order - len(each))) for each in weights)
        self.parts: Structure = native_engine().new(
            "RecursiveFilter",
            numerator=self.numerator,
            denominator=self.denominator,
            state=np.zeros(order),
        )

    def run(self, values: FloatArray) -> FloatArray:
        """Return the filter's next output values, one for each input value."""
        engine, result = native_engine(), np.empty(len(values))
        engine.call(
            "filter_signal", engine.new("FilteredSignal", filter=self.parts, values=values, result=result)
        )
        return result
