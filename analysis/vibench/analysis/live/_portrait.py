"""Phase portrait and Poincaré points of the newest drive periods."""

from dataclasses import dataclass

import numpy as np
from scipy import fft

from ..signals.arrays import Reals
from ..signals.quantity import Quantity
from ..tables import Tabular
from ._ring import RingWindow
from ._sine_response import drive_tone, drive_turns, look_samples, motion_of

SHOWN_PERIODS = 20
_EDGE_PERIODS = 25
"""Additional drive periods at each end of the orbit, needed for integration and drive phase."""
POINTS_A_PERIOD = 120
"""Points per period of the orbit; 2400 points in 20 periods are painted in about 1 ms."""
MOST_POINTS = 3000
"""Maximum number of Poincaré points; older points are dropped."""


@dataclass(frozen=True, eq=False)
class Portrait(Tabular):
    """Orbit of the newest periods, with one Poincaré point per drive period."""

    drive_hz: float
    orbit_displacement_m: Reals
    orbit_velocity_m_per_s: Reals
    """Displacement and velocity of the orbit, shape (samples,)."""
    strobe_displacement_m: Reals
    strobe_velocity_m_per_s: Reals
    """Poincaré points at the maxima of the drive, a cosine; shape (periods,)."""
    strobe_sample: Reals
    """Times of the Poincaré points, in samples since the start of the run."""


def portrait(
    window: RingWindow,
    drive_row: int,
    response_row: int,
    sample_rate_hz: float,
    quantity: Quantity = Quantity.VELOCITY,
    *,
    delay_s: float = 0.0,
) -> Portrait | None:
    """Return the phase portrait of the newest periods; None without a sine drive or with too few samples.

    Parameters
    ----------
    window
        Newest samples in physical units; `portrait_samples` of them are needed.
    delay_s
        Lag of the response channel behind the drive channel [s].
    quantity
        Quantity of the response channel.
    """
    look = look_samples(sample_rate_hz)
    drive = np.asarray(window.values[drive_row], dtype=np.float64)
    tone = drive_tone(drive[-look:], sample_rate_hz) if drive.size >= look else None
    if tone is None or not np.isfinite(window.values[[drive_row, response_row]]).all():
        return None
    count = portrait_samples(tone.frequency_hz, sample_rate_hz)
    if drive.size < count:
        return None
    response = np.asarray(window.values[response_row, -count:], dtype=np.float64)
    displacement, velocity = motion_of(response, sample_rate_hz, tone.frequency_hz, quantity)
    edge = (count - displacement.size) // 2
    turns = drive_turns(drive[-count:], sample_rate_hz, tone.frequency_hz) + delay_s * sample_rate_hz
    turns = turns[(turns >= edge) & (turns <= edge + displacement.size - 1)]
    stride = max(1, int(sample_rate_hz / tone.frequency_hz / POINTS_A_PERIOD))
    place = np.arange(displacement.size)
    return Portrait(
        drive_hz=tone.frequency_hz,
        orbit_displacement_m=displacement[::stride],
        orbit_velocity_m_per_s=velocity[::stride],
        strobe_displacement_m=np.interp(turns - edge, place, displacement),
        strobe_velocity_m_per_s=np.interp(turns - edge, place, velocity),
        strobe_sample=turns + (window.stop_sample - count),
    )


def portrait_samples(frequency_hz: float, sample_rate_hz: float) -> int:
    """Return the number of samples needed for a portrait."""
    wanted = (SHOWN_PERIODS + 2 * _EDGE_PERIODS) * sample_rate_hz / frequency_hz
    return fft.next_fast_len(int(np.ceil(wanted)), real=True)


class PoincareSection:
    """Poincaré points collected from overlapping portraits; each point is collected once."""

    def __init__(self, most: int = MOST_POINTS) -> None:
        self._most = most
        self.displacement_m: Reals = np.empty(0)
        """Displacement of the Poincaré points, shape (points,)."""
        self.velocity_m_per_s: Reals = np.empty(0)
        """Velocity of the Poincaré points, shape (points,)."""
        self._newest = -np.inf

    def add(self, found: Portrait) -> None:
        """Add points that are at least half a period later than the newest collected point."""
        if found.strobe_sample.size == 0:
            return
        spacing = float(np.min(np.diff(found.strobe_sample))) if found.strobe_sample.size > 1 else 1.0
        fresh = found.strobe_sample > self._newest + 0.5 * spacing
        displacement_m = np.append(self.displacement_m, found.strobe_displacement_m[fresh])
        velocity_m_per_s = np.append(self.velocity_m_per_s, found.strobe_velocity_m_per_s[fresh])
        self.displacement_m = displacement_m[-self._most :]
        self.velocity_m_per_s = velocity_m_per_s[-self._most :]
        self._newest = max(self._newest, float(found.strobe_sample[-1]))
