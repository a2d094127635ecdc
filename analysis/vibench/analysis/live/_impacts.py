"""Impacts as the vibrometer sees them: kinks in the motion of m0, counted as they come.

m1 and m2 strike each other; their jump in velocity reaches m0 through springs and dampers: within one
contact its acceleration steps, and changes its slope. The shape of that kink is the same for every
impact, and the smooth motion between impacts is far slower. So the smooth motion is taken away by a
sixth difference, the kinks are looked for by their shape, and the strongest is taken away first, then
the next one, until only noise is left: neighbours a tenth of a millisecond apart are distinguished.

Checked against simulated motions with the noise of the virtual rig (benchmarks/impact_counter.py), 88 to
99 % of the impacts are counted where there are 330 to 1800 a second, and none where there are none.
What is lost is weak: grazing contacts, which change m0's motion less than the noise does, are not seen.
"""

import numpy as np

from ..signals.arrays import Reals
from ._ring import Values

_SPAN_S = 78e-6
"""Between the samples of a difference: longer lets more of the motion through, shorter more noise."""
_DAMPING_TIME_S = 2e-5
"""Of the springs to m0: the step of the acceleration over the change of its slope."""
_CONTACT_S = 30e-6
"""Length of a contact: 20 to 40 us."""
_APART_S = 100e-6
"""Kinks closer than this are counted as one."""
_LEAST_FRESH_S = 20e-3
"""Fewer samples than this say too little about the noise; they wait for more."""
_MOST_FRESH_S = 0.1
"""More samples are looked at piece by piece: each kink is looked for in the whole piece."""
_NOISE_FACTOR = 5.2
"""Over the standard deviation: noise alone is taken for an impact once in two minutes."""
_SMOOTH_FACTOR = 3.0
"""Over what is left of a sine of the motion's mean frequency."""
_REST_SHARE = 0.2
"""Of a kink beside it: less is what is left of that one, for no kink is quite of the one shape."""
_SIXTH_DIFFERENCE = np.array([1.0, -6.0, 15.0, -20.0, 15.0, -6.0, 1.0])
_NOISE_GAIN = np.sqrt(924.0)
"""Of the sixth difference, for white noise."""
_QUIET_SHARE, _QUARTER_OF_NORMAL = 0.25, 0.3186
"""A quarter of the values of |noise| lie below this; impacts disturb most of the others at times."""


class ImpactCounter:
    """Counts kinks in a velocity that comes block by block."""

    def __init__(self, sample_rate_hz: float) -> None:
        span = max(1, round(_SPAN_S * sample_rate_hz))
        self._difference = np.zeros(6 * span + 1)
        self._difference[::span] = _SIXTH_DIFFERENCE
        kink = _kink(self._difference, sample_rate_hz)
        power = float(kink @ kink)
        # What a difference of the samples is correlated with, all in one: samples in, strength of a kink out.
        self._finder = np.convolve(self._difference, kink[::-1]) / power
        self._gain = float(np.sqrt(np.sum(self._finder**2)))
        self._beam = np.correlate(kink, kink, mode="full") / power
        self._reach = kink.size - 1
        self._apart = max(1, round(_APART_S * sample_rate_hz))
        self._most = max(1, round(_MOST_FRESH_S * sample_rate_hz))
        self._least_fresh = round(_LEAST_FRESH_S * sample_rate_hz)
        self._carry = np.empty(0)
        self.count = 0
        """Impacts so far."""

    def add(self, velocity: Values | Reals) -> int:
        """Take the next samples, shape (samples,), lost ones NaN; gives how many impacts were found."""
        starts = range(0, max(1, len(velocity)), self._most)
        return sum(self._add_piece(velocity[first : first + self._most]) for first in starts)

    def _add_piece(self, velocity: Values | Reals) -> int:
        data = np.concatenate((self._carry, np.asarray(velocity, dtype=np.float64)))
        # A kink is separated from what its neighbours leave, so its surroundings must be there.
        fresh = data.size - (self._finder.size - 1) - 2 * self._reach
        if fresh < self._least_fresh:
            self._carry = data
            return 0
        places = self._kinks(data)
        inside = places[(places >= self._reach) & (places < self._reach + fresh)]
        self.count += inside.size
        self._carry = data[fresh:].copy()
        return int(inside.size)

    def _kinks(self, data: Reals) -> "np.ndarray[tuple[int, ...], np.dtype[np.intp]]":
        """Find kinks, the strongest first; each is taken away with all that it does around it."""
        strength = np.nan_to_num(np.convolve(data, self._finder[::-1], mode="valid"))
        least = max(_NOISE_FACTOR * self._gain * _noise(data), _SMOOTH_FACTOR * self._smooth(data))
        size, beside = np.abs(strength), np.zeros(strength.size)
        places: list[int] = []
        for _ in range(strength.size):
            place = int(np.argmax(size))
            if not size[place] > least:
                break
            low, high = max(0, place - self._reach), min(strength.size, place + self._reach + 1)
            found = size[place]
            first = low - place + self._reach
            strength[low:high] -= strength[place] * self._beam[first : first + high - low]
            size[low:high] = np.abs(strength[low:high])
            if found >= _REST_SHARE * beside[place]:
                places.append(place)
                beside[low:high] = np.maximum(beside[low:high], found)
        inorder = np.sort(np.asarray(places, dtype=np.intp))
        return inorder[np.diff(inorder, prepend=-self._apart - 1) > self._apart]

    def _smooth(self, data: Reals) -> float:
        """Return what is left of a sine of the same mean square, and of the same mean square slope."""
        known = data[np.isfinite(data)]
        spread = float(np.std(known)) if known.size > 1 else 0.0
        if spread == 0.0:
            return 0.0
        turn = float(np.std(np.diff(known))) / spread
        left = np.abs(self._finder @ np.exp(1j * turn * np.arange(self._finder.size)))
        return float(np.sqrt(2) * spread * left)


def _noise(data: Reals) -> float:
    """Judge the noise of one sample from what is quiet; infinite where nothing is known."""
    known = data[np.isfinite(data)]
    if known.size <= _SIXTH_DIFFERENCE.size:
        return np.inf
    rough = np.abs(np.convolve(known, _SIXTH_DIFFERENCE, mode="valid")) / _NOISE_GAIN
    quiet = float(np.quantile(rough, _QUIET_SHARE)) / _QUARTER_OF_NORMAL
    # What comes from a viewer has single precision: no noise is less than its last digit.
    return max(quiet, float(np.finfo(np.float32).eps * np.max(np.abs(known))))


def _kink(difference: Reals, sample_rate_hz: float) -> Reals:
    """Return what the difference makes of the velocity after one impact of unit change of slope."""
    around = np.arange(-difference.size, 2 * difference.size) / sample_rate_hz
    moments_s = np.linspace(-0.5 * _CONTACT_S, 0.5 * _CONTACT_S, 7)
    since = np.clip(around[:, np.newaxis] - moments_s, 0.0, None)
    velocity = np.mean(0.5 * since**2 + _DAMPING_TIME_S * since, axis=1)
    shape = np.convolve(velocity, difference, mode="valid")
    seen = np.flatnonzero(np.abs(shape) > 1e-3 * np.abs(shape).max())
    return np.asarray(shape[seen[0] : seen[-1] + 1])
