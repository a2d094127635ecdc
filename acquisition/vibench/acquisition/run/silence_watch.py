"""Whether the drive is silent, as the converter measures it: what was commanded need not be what is.

A converter is read late where its process stood still or was busy: the samples that come after the last
command are then of a time before it.
"""

from math import inf

import numpy as np

from ..errors import InstrumentError
from ..instruments import Block, Samples
from ..rig import Channel, Role
from .low_level_check import STILL_SHARE

SILENT_V = 5e-3
"""Half of peak to peak at the amplifier's input: noise, hum, and the lowest setting of a generator [V]."""
HUM_FACTOR = 2.0
"""On a wire that hums louder than that while nothing plays, so many times the hum."""
LISTEN_S = 0.02
"""A period of the mains, at once the step in which silence is looked for [s]."""
LONGEST_S = 12.0
"""How long is listened at most [s]: longer than the converter's buffer is."""
STILL_ON = 0.1
"""Share of the drive before the stop that is no hum."""


class SilenceWatch:
    """Follows the recorded drive from the moment a stop is seen until nothing is left of it."""

    def __init__(self, channels: tuple[Channel, ...], sample_rate_hz: float) -> None:
        self._row = [channel.role for channel in channels].index(Role.DRIVE_VOLTAGE)
        self._volts_per_volt = channels[self._row].units_per_volt
        self._sample_rate_hz = sample_rate_hz
        self._silent_v = SILENT_V
        self._begin = 0
        self._last_loud = -1
        self._residue_v = inf
        self._loudest_v = 0.0
        self.is_heard = False
        """Whether the drive was still present at the end of the listening time."""

    def learn_hum(self, quiet: Samples) -> None:
        """Take volts (channels, samples) of a time at which nothing played."""
        drive = self._drive(quiet)[round(STILL_SHARE * quiet.shape[1]) :]
        self._silent_v = max(SILENT_V, HUM_FACTOR * _half_peak_to_peak(drive))

    def begin(self, sample: int) -> None:
        """Note that a stop was seen before this sample."""
        self._begin, self._last_loud, self._residue_v = sample, sample - 1, inf

    def take(self, block: Block) -> None:
        """Take the next samples."""
        drive = self._drive(block.volts)
        self._residue_v = _half_peak_to_peak(drive)
        self._loudest_v = max(self._loudest_v, self._residue_v)
        # About its own mean: an offset of the input is no sound.
        loud = np.flatnonzero(np.abs(drive - np.mean(drive)) > self._silent_v)
        if loud.size:
            self._last_loud = block.first_sample + int(loud[-1])

    @property
    def is_silent(self) -> bool:
        """Whether the newest samples are."""
        return self._residue_v <= self._silent_v

    def text(self) -> str:
        """Say how long it took."""
        took_s = (self._last_loud + 1 - self._begin) / self._sample_rate_hz
        if self.is_silent:
            return f"{took_s:.3f} s from the stop being seen to measured silence ({self._residue_v:.2g} V)"
        return f"not silent {took_s:.3f} s after the stop was seen: {self._residue_v:.2g} V at the amplifier"

    def require_silence(self) -> None:
        """Raise InstrumentError when as much is left as no hum is."""
        self.is_heard = not self.is_silent and self._residue_v > STILL_ON * self._loudest_v
        if self.is_heard:
            raise InstrumentError(
                f"the drive is {self.text()}. It was told to be silent and the recording is kept; THE OUTPUT "
                "MAY STILL BE ON: switch the amplifier off by hand"
            )

    def _drive(self, volts: Samples) -> Samples:
        return np.asarray(volts[self._row] * self._volts_per_volt)


def _half_peak_to_peak(volts: Samples) -> float:
    return 0.5 * float(np.ptp(volts)) if volts.size else inf
