"""The voltage that was played, of which a recording shows more: its converter adds noise of its own."""

from functools import cached_property

import numpy as np
import scipy

from ..signals.arrays import Complexes, Reals

_FRAME_SAMPLES = 1 << 15
"""Within which a drive's lines stand apart from noise: half a second to a second."""
_LEVEL_LINES = 256
"""Over which the level of noise is taken: of their median, which a few lines of the drive hardly move."""
_SURELY = 20.0
"""Power of a line over that of noise, which exceeds it once in 5e8 lines."""


class PlayedVoltage:
    """A recorded voltage without its converter's noise, as far as that can be told.

    The converter's noise did not shake the table: simulated under the voltage as recorded, with as much added
    for what is not known of it, a weak motion is lifted twice too much by noise. Frame by frame and line by
    line the part that is likely stays (Wiener's filter; all of what surely is no noise), and what that leaves
    open is drawn: draws scatter as far as the voltage is not known, and their power is that of the recording
    less the converter's.
    """

    def __init__(self, volts: Reals, converter_rms_v: float) -> None:
        self._volts, self._own_v = volts, converter_rms_v
        frame = min(_FRAME_SAMPLES, max(4, volts.size // 2))
        self._frames = scipy.signal.ShortTimeFFT(scipy.signal.windows.hann(frame, sym=False), frame // 2, 1.0)

    @cached_property
    def _likely(self) -> tuple[Complexes, Reals]:
        """Lines of each frame, shape (lines, frames): the likely part, and its share of what was recorded."""
        lines = self._frames.stft(self._volts)
        own = self._own_v**2 * float(np.sum(self._frames.win**2))
        power = np.abs(lines) ** 2
        # The median of exponentially distributed powers is log 2 of their mean.
        level = np.concatenate(
            [
                np.broadcast_to(np.median(each, axis=0) / np.log(2.0), each.shape)
                for each in np.array_split(power, max(1, len(power) // _LEVEL_LINES))
            ]
        )
        total = np.maximum(level, own)
        share = np.where(power > _SURELY * total, 1.0, 1.0 - own / np.where(total > 0.0, total, 1.0))
        return share * lines, share

    def drawn(self, rng: np.random.Generator) -> Reals:
        """Give a voltage that may have been played, shape (samples,) [V]."""
        if self._own_v == 0.0:
            return self._volts
        lines, share = self._likely
        own = self._frames.stft(self._own_v * rng.standard_normal(self._volts.size))
        return np.asarray(self._frames.istft(lines + np.sqrt(share) * own, k1=self._volts.size).real)


def above_noise(volts: Reals, rms: float) -> Reals:
    """Give what surely is voltage and no noise of its channel, which would shake a simulated table."""
    spectrum = np.fft.rfft(volts)
    spectrum[np.abs(spectrum) ** 2 < _SURELY * volts.size * rms**2] = 0.0
    return np.asarray(np.fft.irfft(spectrum, volts.size))
