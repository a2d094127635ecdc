"""Impacts as the vibrometer sees them: kinks in the acceleration of m0, counted as they come.

m1 and m2 strike each other; their jump in velocity reaches m0 through a spring and bends its
acceleration within one contact. Around such a kink the acceleration's slope before differs from that
after by far more than a smooth motion's does. It is what a viewer is shown: on recordings of the
virtual rig it sees 57 to 118 % of the simulated number of impacts, where these are 350 to 2000 a
second, and none where there are none. Weak impacts drown in the noise; contacts closer than a
tenth of a millisecond are seen as one.
"""

import numpy as np
from scipy.ndimage import maximum_filter1d

from ..arrays import Reals
from .ring import Values

_SPAN_S = 40e-6
"""Distance over which slopes are taken: as long as a contact (20 to 40 us)."""
_APART_S = 100e-6
"""Kinks closer than this are counted as one."""
_LEAST_FRESH_S = 20e-3
"""Fewer samples than this say too little about the noise; they wait for more."""
_NOISE_FACTOR = 12.0
"""Over the standard deviation, for the steady motion between impacts is not quite straight either."""
_SMOOTH_FACTOR = 3.0
"""Over what a sine of the motion's mean frequency can show: room for 7 % of third harmonic."""
_SIXTH_DIFFERENCE = np.array([1.0, -6.0, 15.0, -20.0, 15.0, -6.0, 1.0]) / np.sqrt(924.0)
"""Of unit gain for white noise: it removes what is smooth and leaves the noise."""
_SLOPES_NOISE = np.sqrt(10.0)
"""Gain of v(2L) - 2 v(L) + 2 v(-L) - v(-2L) for white noise."""
_QUIET_SHARE, _QUARTER_OF_NORMAL = 0.25, 0.3186
"""A quarter of the values of |noise| lie below this; impacts disturb most of the others at times."""


class ImpactCounter:
    """Counts kinks in a velocity that comes block by block.

    Slopes that a smooth motion of the velocity's own mean frequency may have, a few percent of third
    harmonic included, are told from kinks.
    """

    def __init__(self, sample_rate_hz: float) -> None:
        self._span = max(1, round(_SPAN_S * sample_rate_hz))
        self._apart = max(1, round(_APART_S * sample_rate_hz))
        self._least_fresh = round(_LEAST_FRESH_S * sample_rate_hz)
        self._carry = np.empty(0)
        self._count = 0

    @property
    def count(self) -> int:
        """Impacts so far."""
        return self._count

    def add(self, velocity: Values | Reals) -> int:
        """Take the next samples, shape (samples,), lost ones NaN; gives how many impacts were found."""
        data = np.concatenate((self._carry, np.asarray(velocity, dtype=np.float64)))
        # A kink counts where it is larger than all around it, so what surrounds it must be there.
        margin = 2 * self._span + self._apart
        fresh = data.size - 2 * margin
        if fresh < self._least_fresh:
            self._carry = data
            return 0
        found = self._kinks(data)
        self._count += found
        self._carry = data[fresh:].copy()
        return found

    def _kinks(self, data: Reals) -> int:
        span = self._span
        after = data[4 * span :] - 2 * data[3 * span : -span]
        before = data[: -4 * span] - 2 * data[span : -3 * span]
        size = np.nan_to_num(np.abs(after - before))
        is_peak = (size == maximum_filter1d(size, 2 * self._apart + 1)) & (size > self._threshold(data))
        return int(np.count_nonzero(is_peak[self._apart : size.size - self._apart]))

    def _threshold(self, data: Reals) -> float:
        known = data[np.isfinite(data)]
        if known.size <= _SIXTH_DIFFERENCE.size:
            return np.inf
        rough = np.abs(np.convolve(known, _SIXTH_DIFFERENCE, mode="valid"))
        noise = float(np.quantile(rough, _QUIET_SHARE)) / _QUARTER_OF_NORMAL
        return max(_NOISE_FACTOR * float(_SLOPES_NOISE) * noise, _SMOOTH_FACTOR * self._smooth(known))

    def _smooth(self, known: Reals) -> float:
        """Third derivative, taken over the span, of a sine of the same mean square and of its slope's."""
        spread = float(np.std(known))
        if spread == 0.0:
            return 0.0
        turn = float(np.std(np.diff(known))) / spread * self._span
        return float(2.0 * turn**3 * np.sqrt(2) * spread)
