"""From the values of a waveform to the codes of the generator's memory, and what is lost on the way."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import LimitExceeded
from ..instruments import Samples

# AFG1022 edit memory: hardware reference 1.2 (IVI driver tkafg1k; drivers that read it back).
FEWEST_POINTS = 2
MOST_POINTS = 8192
HIGHEST_CODE = 16383
_MIDDLE = HIGHEST_CODE / 2


@dataclass(frozen=True)
class ArbitraryCodes:
    """One period as the generator's memory holds it: free of DC, over the full range of codes.

    The terminal plays ``achieved * amplitude_vpp / 2``, where the panel is set to
    ``amplitude_vpp * panel_factor``.
    """

    codes: NDArray[np.uint16]
    """0 to 16383, shape (points,)."""
    removed_mean: float
    """Mean of the values as given: taken out, since DC would push the shaker off its centre."""
    panel_factor: float
    """Largest magnitude that is left: 1 for a waveform that is free of DC and reaches 1."""

    @property
    def achieved(self) -> Samples:
        """Values that the codes stand for, on the scale of the values as given."""
        return self.panel_factor * (self.codes / _MIDDLE - 1.0)

    @property
    def residual_mean(self) -> float:
        """DC that rounding leaves, on the scale of the values as given."""
        return float(self.achieved.mean())

    @property
    def step(self) -> float:
        """One code, on the scale of the values as given."""
        return self.panel_factor / _MIDDLE


def arbitrary_codes(waveform: Samples) -> ArbitraryCodes:
    """Turn one period of values into codes of the full range.

    Code 0 stands for minus, and 16383 for plus, half of the amplitude on the panel. The mean is
    removed, and what is left is scaled so that its largest magnitude takes an outermost code.

    Raises
    ------
    LimitExceeded
        When the waveform has too few or too many points, is not finite, leaves -1 to 1, or is constant.

    """
    values = np.asarray(waveform, dtype=np.float64)
    if values.ndim != 1 or not FEWEST_POINTS <= values.size <= MOST_POINTS:
        raise LimitExceeded(
            f"the waveform has the shape {values.shape}; the generator's memory takes one period of "
            f"{FEWEST_POINTS} to {MOST_POINTS} points. Nothing was sent; resample it"
        )
    peak = float(np.max(np.abs(values)))
    # Not "peak > 1": a NaN must not pass.
    if not peak <= 1.0 + 1e-9:
        raise LimitExceeded(
            f"the largest magnitude of the waveform is {peak:g}; values from -1 to 1 are allowed "
            "(the amplitude is given apart). Nothing was sent; scale it"
        )
    mean = float(values.mean())
    swing = values - mean
    factor = float(np.max(np.abs(swing)))
    if factor <= np.finfo(np.float64).eps:
        raise LimitExceeded(
            "the waveform is constant: without its mean nothing is left to play. Nothing was sent; "
            "give one period that moves"
        )
    codes = np.clip(np.rint(_MIDDLE + swing / factor * _MIDDLE), 0, HIGHEST_CODE).astype(np.uint16)
    return ArbitraryCodes(codes, mean, factor)
