"""Check of a track by sensors on m1 or m2."""

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from scipy.ndimage import maximum_filter1d

from vibench.acquisition.recording import Recording

from ..errors import UnusableData
from ..recordings.channels import BASE
from ..recordings.response import ResponseChannel, response_roles
from ..signals.arrays import Reals
from ._prepared_motion import PreparedMotion, white_noise
from ._sensor_correction import HALF_LENGTH, sensor_correction
from ._tracking import TrackedPiece
from ._tracking_model import VY, VZ, W

_RATES = {"m1": VY, "m2": VZ}
_MOST_EXCESS = 1.25
"""Largest ratio of the mean squared deviation to the expected one, as for a track's innovations."""
_ALLOWED = 0.02
"""Allowed relative deviation due to mounting, alignment and local modes at the sensor."""
_MOST_EXPECTED = 0.2
"""Largest expected deviation for a verdict; for an accelerometer on a colliding mass, blows are noise."""
_MOST_SCALE = 0.05
"""Largest deviation of the scale from 1: both calibrations may be wrong by some per cent."""


@dataclass(frozen=True)
class MassCheck:
    """Comparison of a mass's measured velocity with the track."""

    channel: str
    scale: float
    """Ratio of measured to tracked velocity."""
    unexplained: float
    """Part of the measured velocity that the track does not explain (rms)."""
    expected: float
    """Unexplained part to be expected from noise, the track's uncertainty and the sensor's mounting."""

    @property
    def confirms(self) -> bool | None:
        """Whether the track explains the measured velocity; None if the sensor cannot tell."""
        if not self.expected <= _MOST_EXPECTED:
            return None
        return self.unexplained**2 <= _MOST_EXCESS * self.expected**2 and abs(self.scale - 1) <= _MOST_SCALE

    @property
    def sentence(self) -> str:
        """Return the verdict with its numbers."""
        verdict = {True: "confirms", False: "refutes", None: "neither confirms nor refutes"}[self.confirms]
        return (
            f"The measured {self.channel} {verdict} the track: "
            f"{100 * self.unexplained:.2g} % of it remain, {100 * self.expected:.2g} % are expected, and its "
            f"scale is {self.scale:.3f}."
        )


@dataclass
class MeasuredMass:
    """A sensor on m1 or m2 over the samples of a motion, compared with the pieces of a track."""

    channel: str
    velocity: Reals
    """Measured velocity [m/s], shape (samples,); NaN where it is not known."""
    noise: float
    """Rms noise [m/s]."""
    _sums: Reals = field(default_factory=lambda: np.zeros(5))

    def add(self, piece: TrackedPiece) -> None:
        """Add a piece, without the samples near collisions, where a converter's filter rings."""
        measured = self.velocity[piece.first : piece.stop]
        touched = maximum_filter1d(piece.smoothed.touched.astype(np.uint8), 2 * HALF_LENGTH + 1)
        used = np.isfinite(measured) & (touched == 0)
        places = [_RATES[self.channel[:2]], W]
        tracked = piece.smoothed.states[used][:, places].sum(axis=1)
        # This is the variance of the filter's predictions; the smoother's is smaller.
        variance = piece.run.covariances[used][:, places][:, :, places].sum(axis=(1, 2))
        measured = measured[used]
        self._sums += (
            measured.size,
            measured @ measured,
            measured @ tracked,
            tracked @ tracked,
            variance.sum(),
        )

    def check(self, level: float) -> MassCheck | None:
        """Return the comparison; None without samples. ``level`` widens the track's variance."""
        count, measured, both, tracked, variance = self._sums.tolist()
        if not count or not measured or not tracked:
            return None
        expected = max(1.0, level) * variance + count * self.noise**2
        return MassCheck(
            self.channel,
            both / tracked,
            float(np.sqrt(max(0.0, 1.0 - both**2 / (tracked * measured)))),
            float(np.sqrt(expected / measured + _ALLOWED**2)),
        )


def measured_masses(recording: Recording, motion: PreparedMotion) -> Iterator[MeasuredMass]:
    """Yield the sensors on m1 and m2 over the samples of a motion, corrected for their dynamics."""
    rate_hz, start = motion.sample_rate_hz, motion.first_sample
    stop = start + motion.samples
    for role in response_roles(recording):
        if role[:2] not in _RATES:
            continue
        try:
            channel = ResponseChannel(recording, role)
        except UnusableData:  # too short for an integral
            continue
        weights = sensor_correction(
            recording.bench, recording.channel(BASE), recording.channel(role), rate_hz
        ).velocity
        heard = channel.read(start, stop)
        noise = white_noise(np.nan_to_num(recording.read(role, start, stop))) * channel.noise_gain
        yield MeasuredMass(role, np.convolve(heard - np.nanmean(heard), weights, "same"), noise)
