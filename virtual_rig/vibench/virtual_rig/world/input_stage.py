"""In front of the converter: excitation current, coupling, and the voltage at which the input clips."""

import numpy as np
from numpy.typing import NDArray

from ..analogue import Coupling, Input
from .sensors import IEPE_BIAS_V
from .time_grid import USUAL_GRID, RecursiveFilter, TimeGrid
from .wiring import Behind, Cable

FloatArray = NDArray[np.float64]

AC_CUT_HZ = 0.5
"""-3 dB of the coupling capacitor: NI 9234 and USB-4431 alike; first order here."""
LEAST_EXCITATION_A = 1e-3
"""Below, an IEPE sensor's electronics do not work."""
SOURCE_OHM = 50.0
"""Output resistance of generator, divider and decoder alike, over which excitation current drops."""
COMPLIANCE_V = 19.0
"""What an open input rises to when its excitation finds no sensor."""
OVER_RANGE = 1.02
"""The modulator follows this much beyond the range, whose end is where the numbers end."""


def clip_v(range_v: float) -> float:
    """Return the voltage at which the modulator of an input of that range clips [V]."""
    return range_v * OVER_RANGE


class InputStage:
    """One input from its connector to the converter, running along with the world."""

    def __init__(self, configured: Input, cable: Cable, grid: TimeGrid = USUAL_GRID) -> None:
        """``cable`` says what the input is connected to."""
        self.configured = configured
        self.cable = cable
        self._offset_v, self._gain = _operating_point(configured, cable)
        self._clip_v = clip_v(configured.range_v)
        half_turn = np.pi * AC_CUT_HZ * grid.step_s
        self._capacitor = RecursiveFilter(
            np.array([1.0, -1.0]) / (1 + half_turn), [1.0, -(1 - half_turn) / (1 + half_turn)]
        )

    def plug(self, cable: Cable) -> None:
        """Change what the input is connected to."""
        self.cable = cable
        self._offset_v, self._gain = _operating_point(self.configured, cable)

    def pass_on(self, signals: FloatArray) -> tuple[FloatArray, bool]:
        """Volts at the converter and whether they clip, from the world's signals, shape (signals, steps)."""
        signal = signals[self.cable.signal]
        match self.configured.coupling:
            case Coupling.AC:
                # The capacitor has long been charged to the constant part when a conversion begins.
                volts = self._capacitor.run(signal * self._gain)
            case Coupling.DC:
                volts = signal * self._gain
                volts += self._offset_v
        clips = bool(np.abs(volts).max(initial=0.0) > self._clip_v)
        return np.clip(volts, -self._clip_v, self._clip_v) if clips else volts, clips


def _operating_point(configured: Input, cable: Cable) -> tuple[float, float]:
    """Constant volts at the input, and volts at the input per volt of the signal."""
    powered = configured.iepe_current_a >= LEAST_EXCITATION_A
    match cable.behind:
        case Behind.VOLTAGE_SOURCE:
            return configured.iepe_current_a * SOURCE_OHM, 1 / cable.attenuation
        case Behind.IEPE_SENSOR if powered:
            return IEPE_BIAS_V, 1 / cable.attenuation
        case Behind.NOTHING if powered:
            return COMPLIANCE_V, 0.0
        case _:
            return 0.0, 0.0
