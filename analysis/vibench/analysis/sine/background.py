"""What a displacement holds that the drive does not make: noise of the sensor, a floor that shakes, hum."""

from dataclasses import dataclass

import numpy as np

from vibench.acquisition.plan import CHECK_QUIET_S
from vibench.acquisition.recording import SegmentLabel

from ..chaos.verdict import SMALL
from ..recordings.channels import Channels
from ..signals.arrays import Reals
from ..spectra.spectra import spectral_density

NOTHING: Reals = np.empty(0)
_EXPLAINED = 1.5
"""What is left of a motion over the vibrometer's noise, up to which that is all of it."""
_SILENT = 3.0
"""... and over what the silence held, which is shorter than the memory of a mode."""
OVERHEARD = 20.0
"""What is left over what was heard, up to which it may be noise all the same.

A mode that noise rings is as faint in one silence of 400 that is shorter than its memory, and a
generator's own noise is not heard at all.
"""
BETWEEN = "what the motion holds between its lines"


@dataclass(frozen=True)
class Background:
    """Noise in a window of displacement."""

    rms_m: float
    """Root mean square; NaN where nothing tells it from motion."""
    frequency_hz: float
    """Its rms frequency: a window holds twice as many independent values as turns of it."""
    source: str
    """What tells it, or why nothing does."""

    @property
    def is_rest(self) -> bool:
        """Whether it is all that does not repeat, so that what repeats is the motion."""
        return self.source == BETWEEN

    @property
    def is_known(self) -> bool:
        """Whether anything tells it."""
        return bool(np.isfinite(self.rms_m))


def silence_before(channels: Channels) -> Reals:
    """Give the response while the check listened before anything played [m/s]; empty without a check."""
    for stretch in channels.stretches(SegmentLabel.CHECK):
        stop = stretch.start + round(CHECK_QUIET_S * channels.sample_rate_hz)
        heard: Reals = channels.read(stretch.start, min(stop, stretch.stop))[-1]
        return heard if np.isfinite(heard).all() else heard[:0]
    return NOTHING


def heard_in(velocity: Reals, band_hz: tuple[float, float], rate_hz: float) -> Background:
    """Say what a silence holds in a band, as displacement; NaN where it is too short for its low end."""
    source = "silence before the check"
    if 2 * velocity.size < rate_hz / band_hz[0]:
        return Background(np.nan, np.nan, source)
    found = spectral_density(velocity - velocity.mean(), rate_hz, segment_samples=velocity.size)
    inside = (found.frequency_hz >= band_hz[0]) & (found.frequency_hz <= band_hz[1])
    omega = 2 * np.pi * found.frequency_hz[inside]
    fast, slow = (float(np.sum(found.density[inside] / omega**power)) for power in (0, 2))
    rms_m = np.sqrt(slow * (found.frequency_hz[1] - found.frequency_hz[0]))
    return Background(float(rms_m), float(np.sqrt(fast / slow) / (2 * np.pi)) if slow else 0.0, source)


def left_between(rest: Reals, rate_hz: float) -> Background:
    """Say what a displacement holds without all that repeats with the drive."""
    rms_m = float(np.std(rest))
    turns = float(np.std(np.diff(rest))) * rate_hz / (2 * np.pi)
    return Background(rms_m, turns / rms_m if rms_m else 0.0, BETWEEN)


def background_of(rest: Background, motion_m: float, sensor: Background, silent: Background) -> Background:
    """Say how much of what does not repeat with the drive is noise, and how fast that is.

    Chaos does not repeat either. What is left between the lines is noise where the vibrometer's own explains
    it, or what was heard before anything played, or where it is so small a part that a motion with it counts
    as periodic. Larger, it may be motion: then the silence alone tells the noise, and nothing where none was
    recorded.

    Parameters
    ----------
    rest
        What is left between the lines.
    motion_m
        The whole motion, root mean square.
    sensor
        The vibrometer's noise, as if it were white.
    silent
        What was heard before anything played.

    """
    heard_m = silent.rms_m if silent.is_known else 0.0
    if rest.rms_m <= max(_EXPLAINED * sensor.rms_m, _SILENT * heard_m, SMALL * motion_m):
        return rest
    if silent.is_known:
        return louder(silent, sensor)
    return Background(
        np.nan,
        np.nan,
        f"{100 * rest.rms_m / motion_m:.2g} % of the motion does not repeat, which may be noise or motion, "
        "and no silence was recorded before it; measure with the check of the bench",
    )


def louder(silent: Background, sensor: Background) -> Background:
    """Give the louder of what was heard and what the sensor makes by itself."""
    return silent if silent.rms_m > sensor.rms_m else sensor
