"""From the values of a waveform to the codes of the generator's memory, and what is lost on the way."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import LimitExceeded
from ..instruments import Samples
from ._generator_limits import GeneratorModel


@dataclass(frozen=True)
class ArbitraryCodes:
    """One period as the generator's memory holds it: free of DC, over the full range of codes.

    The terminal plays ``achieved * amplitude_vpp / 2``, where the panel is set to
    ``amplitude_vpp * panel_factor``.
    """

    codes: NDArray[np.uint16]
    """0 to ``top_code``, shape (points,)."""
    top_code: int
    """The code of plus half of the amplitude on the panel; 0 is that of minus half."""
    panel_factor: float
    """Largest magnitude that is left: 1 for a waveform that is free of DC and reaches 1."""

    @property
    def achieved(self) -> Samples:
        """Values that the codes stand for, on the scale of the values as given."""
        return self.panel_factor * (2 * self.codes / self.top_code - 1.0)


def arbitrary_codes(waveform: Samples, model: GeneratorModel) -> ArbitraryCodes:
    """Turn one period of values into codes of the full range.

    Code 0 stands for minus, and the highest one for plus, half of the amplitude on the panel. The mean is
    removed, since DC would push the shaker off its centre, and what is left is scaled so that its largest
    magnitude takes an outermost code.

    Raises
    ------
    LimitExceeded
        When the waveform has too few or too many points, is not finite, leaves -1 to 1, or is constant.

    """
    values = np.asarray(waveform, dtype=np.float64)
    fewest, most = model.memory_points
    if values.ndim != 1 or not fewest <= values.size <= most:
        raise LimitExceeded(
            f"the waveform has the shape {values.shape}; the generator's memory takes one period of "
            f"{fewest} to {most} points. Nothing was sent; resample it"
        )
    peak = float(np.max(np.abs(values)))
    # Not "peak > 1": a NaN must not pass.
    if not peak <= 1.0 + 1e-9:
        raise LimitExceeded(
            f"the largest magnitude of the waveform is {peak:g}; values from -1 to 1 are allowed "
            "(the amplitude is given apart). Nothing was sent; scale it"
        )
    swing = values - values.mean()
    factor = float(np.max(np.abs(swing)))
    if factor <= np.finfo(np.float64).eps:
        raise LimitExceeded(
            "the waveform is constant: without its mean nothing is left to play. Nothing was sent; "
            "give one period that moves"
        )
    middle = model.top_code / 2
    codes = np.clip(np.rint(middle + swing / factor * middle), 0, model.top_code).astype(np.uint16)
    return ArbitraryCodes(codes, model.top_code, factor)
