"""Find drop-outs in the vibrometer's velocity, and bridge them from the samples on both sides.

Speckle interrupts the laser's signal for a fraction of a millisecond; the decoder then outputs an arbitrary
velocity. In a drop-out, the signal jumps away from the motion within one sample and later returns to it. Real
motion looks different: an impact changes the velocity permanently, and ringing oscillates.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np
import scipy
from numpy.typing import NDArray

from ..instruments import Samples
from ._reader import Recording

Places = NDArray[np.int64]

LONGEST_S = 4e-3
"""Longest drop-out that can be bridged [s]."""
LOWEST_RATE_HZ = 20_000.0
"""Lowest sample rate of the search [Hz]; at lower rates, an impact may be as short as a drop-out."""
_FAR = 60.0
"""Smallest fourth difference at the edge of a drop-out, relative to the median fourth difference."""
_DETECTED = 6.0
"""Smallest fourth difference in the ringing of the converter's filter, relative to the overall median."""
_SILENT = 6
_QUIET_S = 2.5e-4
"""Largest spacing between sharp corners of one group (run) [s]."""
_MOST_RUNS = 12
"""Largest number of neighbouring runs that drop-outs can explain; more runs indicate real motion."""
_FLANK_S = 1e-3
"""Duration of the motion on each side with which a drop-out is compared (flank) [s]."""
_LEAST_HELD = 8
"""Smallest number of equal samples that indicate a drop-out, if both ends are steep (`_QUANTA`)."""
_QUANTA = 4.0
"""Smallest change at both ends of such equal samples, relative to the channel's smallest change."""
_LEAST_OF_FLANK = 0.25
"""Smallest fraction of a flank that must be free of other drop-outs."""
DROPOUT_DELAY_S = LONGEST_S + 2.0 * _FLANK_S
"""Time after a sample that is needed to decide whether the sample belongs to a drop-out [s]."""
_OUTSTANDING = 8.0
"""Smallest distance of a drop-out from a smooth fit, relative to the rms residual in the flanks."""
_JUMP = 4.0
"""Smallest change between samples at the edge of a drop-out, relative to the largest change in the flanks."""
_STEEP = 0.2
"""Smallest change at an edge, relative to the largest distance from the fit; smaller in clipped peaks."""
_MOST_PER_S = 400.0
"""Largest number of drop-outs per second; a larger number indicates real motion."""
_ORDER = 48
_CONTEXT = 12 * _ORDER
"""Number of samples on each side that the linear prediction uses."""
_TOGETHER = 4 * _CONTEXT
"""Longest group of drop-outs that is bridged at once [samples]."""
_BLOCK_S = 1.0


class Dropout(NamedTuple):
    """Range of samples of a drop-out, including the ringing of the converter's filter."""

    first: int
    stop: int
    """Number of the sample after the drop-out's last sample."""


def find_dropouts(velocity: Samples, sample_rate_hz: float) -> tuple[Dropout, ...]:
    """Return the drop-outs, in which the signal jumps away from the motion and later returns to it.

    ``velocity`` is about one second long, shape (samples,), with NaN for lost samples. Below a sample rate of
    20 kHz no drop-outs are reported.
    """
    flank = round(_FLANK_S * sample_rate_hz)
    if sample_rate_hz < LOWEST_RATE_HZ or velocity.size < 4 * flank:
        return ()
    longest = LONGEST_S * sample_rate_hz
    found = _hold_dropouts(velocity, longest)
    velocity = bridge(velocity, tuple(found))
    sharp, usual = _corners(velocity)
    rings, far = sharp > _DETECTED * usual, np.flatnonzero(sharp > _FAR * usual)

    def explain(edges: Places) -> tuple[Dropout, ...]:
        runs = [
            Dropout(
                int(run[0]) - _ringing(rings[run[0] :: -1], flank) - 2,
                int(run[-1]) + _ringing(rings[run[-1] :], flank) + 3,
            )
            for run in _apart(edges, _QUIET_S * sample_rate_hz)
        ]
        return _explain(velocity, runs, flank, longest) if len(runs) <= _MOST_RUNS else ()

    for edges in _apart(far, longest) if far.size else ():
        together = explain(edges)
        for each in [] if together else _apart(edges, flank):
            together += explain(each)
        found += together
    return _join(sorted(found), flank) if len(found) <= _MOST_PER_S * velocity.size / sample_rate_hz else ()


def _hold_dropouts(velocity: Samples, longest: float) -> list[Dropout]:
    """Return drop-outs in which the decoder repeats one value; noise may hide the corners of a drop-out."""
    change = np.abs(np.diff(velocity))
    moves = np.flatnonzero(change != 0.0)
    first, last, equal = moves[:-1], moves[1:], np.diff(moves)
    steep = change > _QUANTA * np.min(change, where=change > 0.0, initial=np.inf)
    # Samples of a clipped peak are also equal, so exclude the channel's largest magnitude.
    is_inside = np.abs(velocity[last]) < np.fmax.reduce(np.abs(velocity))
    held = (equal >= _LEAST_HELD) & (equal <= longest) & steep[first] & steep[last] & is_inside
    ends = zip(first[held].tolist(), last[held].tolist(), strict=True)
    return [Dropout(max(begin - 1, 0), end + 3) for begin, end in ends]


def _join(found: Sequence[Dropout], flank: int) -> tuple[Dropout, ...]:
    """Return the drop-outs; drop-outs less than a flank apart are joined."""
    joined: list[Dropout] = []
    for each in found:
        if joined and each.first - joined[-1].stop < flank:
            joined[-1] = Dropout(joined[-1].first, max(joined[-1].stop, each.stop))
        else:
            joined.append(each)
    return tuple(joined)


def first_undecided(velocity: Samples, sample_rate_hz: float, dropouts: tuple[Dropout, ...]) -> int:
    """Return the first sample of a drop-out that may still be undetected, or else the number of samples.

    ``velocity`` belongs to a channel that is still being recorded, shape (samples,), in which ``dropouts``
    were found.
    """
    if sample_rate_hz < LOWEST_RATE_HZ or velocity.size < 5:
        return velocity.size
    sharp, usual = _corners(velocity)
    far = np.flatnonzero(sharp > _FAR * usual)
    far = far[far >= velocity.size - round(DROPOUT_DELAY_S * sample_rate_hz)]
    known = np.zeros(velocity.size, dtype=np.bool_)
    for each in dropouts:
        known[each.first : each.stop] = True
    open_ones = far[~known[far]]
    return max(int(open_ones[0]) - round(_FLANK_S * sample_rate_hz), 0) if open_ones.size else velocity.size


def _corners(velocity: Samples) -> tuple[Samples, float]:
    """Return fourth differences, which are large at sharp corners, and their median (infinity if zero)."""
    sharp = np.zeros(velocity.size)
    sharp[2:-2] = np.abs(np.diff(velocity, 4))
    return sharp, float(np.nanmedian(sharp)) or np.inf


def _apart(places: Places, distance: float) -> list[Places]:
    """Split sorted sample numbers wherever two neighbours differ by more than ``distance``."""
    return np.split(places, np.flatnonzero(np.diff(places) > distance) + 1)


def _explain(velocity: Samples, runs: Sequence[Dropout], flank: int, longest: float) -> tuple[Dropout, ...]:
    """Return drop-outs that together explain all of these runs of sharp corners; empty if impossible.

    The fewest drop-outs are chosen, then those with the smoothest motion around them. Otherwise the two edges
    of one drop-out could be taken for two drop-outs, with the constant level between them as motion.
    """
    ends = [0, *(each.stop for each in runs)]
    begins = [*(each.first for each in runs), velocity.size]
    best: list[tuple[int, float, tuple[Dropout, ...]] | None] = [(0, 0.0, ())]
    for last in range(1, len(runs) + 1):
        ways = []
        for first, so_far in enumerate(best):
            one = Dropout(begins[first], ends[last])
            # The flanks end at the neighbouring runs, whose samples do not represent motion.
            before, after = min(flank, one.first - ends[first]), min(flank, begins[last] - one.stop)
            is_alone = min(before, after) >= flank * _LEAST_OF_FLANK
            is_short = one.stop - one.first <= longest + flank  # `flank` allows for ringing on both sides
            if so_far is not None and is_alone and is_short:
                rough = _roughness(velocity, one, before, after)
                if rough < np.inf:
                    ways.append((so_far[0] + 1, so_far[1] + rough, (*so_far[2], one)))
        best.append(min(ways, default=None))
    return best[-1][2] if best[-1] else ()


def _ringing(rings: NDArray[np.bool_], longest: int) -> int:
    """Return the ringing time of the converter's filter [samples]; `_SILENT` quiet samples mark the end."""
    heard = np.flatnonzero(rings[:longest])
    breaks = np.flatnonzero(np.diff(heard) > _SILENT)
    return int(heard[breaks[0]] if breaks.size else heard[-1])


def _roughness(velocity: Samples, dropout: Dropout, before: int, after: int) -> float:
    """Return the mean square residual of a smooth fit to both flanks; infinite if the range is no drop-out.

    A drop-out jumps far away from the fit. A clipped peak is also far from the fit, but changes more slowly.
    """
    near = velocity[dropout.first - before : dropout.stop + after]
    if not np.all(np.isfinite(near)):
        return np.inf
    at = np.linspace(-1.0, 1.0, near.size)
    outside = np.ones(at.size, dtype=np.bool_)
    outside[before:-after] = False
    pace = np.abs(np.diff(near))
    if np.max(pace[before:-after]) < _JUMP * max(np.max(pace[:before]), np.max(pace[-after:])):
        return np.inf
    shape = np.polynomial.legendre.legvander(at, 5)
    left = near - shape @ scipy.linalg.lstsq(shape[outside], near[outside])[0]
    rough = float(np.mean(left[outside] ** 2))
    distance = np.max(np.abs(left[~outside]))
    is_far = distance**2 > _OUTSTANDING**2 * rough
    is_steep = np.max(pace[before:-after]) > _STEEP * distance
    return rough if is_far and is_steep else np.inf


def bridge(velocity: Samples, dropouts: tuple[Dropout, ...]) -> Samples:
    """Return a copy of ``velocity``, shape (samples,), with drop-outs bridged by linear prediction.

    The bridge minimises the prediction error of a linear predictor fitted to the samples around the drop-out
    (Janssen, Veldhuis and Vries 1986, IEEE Trans. ASSP 34, 317-330).
    """
    bridged_velocity, hidden = velocity.copy(), np.zeros(velocity.size, dtype=np.bool_)
    for each in dropouts:
        hidden[each.first : each.stop] = True
    for first, stop, behind in _groups(dropouts, velocity.size):
        near = slice(max(first - _CONTEXT, 0), min(stop + _CONTEXT, behind))
        if np.all(np.isfinite(bridged_velocity[near][~hidden[near]])):
            bridged_velocity[near] = _likeliest(bridged_velocity[near], ~hidden[near])
        hidden[:stop] = False
    return bridged_velocity


def _groups(dropouts: tuple[Dropout, ...], samples: int) -> Iterator[tuple[int, int, int]]:
    """Yield beginning and end of each group of close drop-outs, and the beginning of the next group."""
    groups: list[list[Dropout]] = []
    for each in dropouts:
        is_near = groups and each.first - groups[-1][-1].stop < _CONTEXT
        if is_near and each.stop - groups[-1][0].first < _TOGETHER:
            groups[-1].append(each)
        else:
            groups.append([each])
    for place, group in enumerate(groups):
        behind = groups[place + 1][0].first if place + 1 < len(groups) else samples
        yield group[0].first, group[-1].stop, behind


def _likeliest(near: Samples, known: NDArray[np.bool_]) -> Samples:
    """Return samples whose unknown values are filled by linear prediction; unchanged if too few are known."""
    mean = float(np.mean(near[known]))
    values = np.where(known, near - mean, 0.0)
    windows, whole = (np.lib.stride_tricks.sliding_window_view(each, _ORDER + 1) for each in (values, known))
    past, now = np.split(windows[whole.all(axis=1)], [_ORDER], axis=1)
    if len(past) < 2 * _ORDER:
        return near
    predictor = scipy.linalg.lstsq(past, now[:, 0])[0]
    # Prediction errors of all windows, as a band matrix times the samples.
    row, column = np.zeros(near.size), np.zeros(near.size - _ORDER)
    row[: _ORDER + 1] = np.append(-predictor, 1.0)
    column[0] = row[0]
    errors = scipy.linalg.toeplitz(column, row)
    values[~known] = scipy.linalg.lstsq(errors[:, ~known], -errors @ values)[0]
    return mean + values


_FOUND: WeakKeyDictionary[Recording, dict[tuple[str, int], tuple[Dropout, ...]]] = WeakKeyDictionary()
"""Cache of the drop-outs in each second of an open recording."""


@dataclass(frozen=True, eq=False)
class BridgedChannel:
    """The vibrometer's channel of a recording, read with its drop-outs bridged.

    The search uses fixed blocks of one second, so that results do not depend on the range that is read.
    """

    recording: Recording
    role: str

    def read(self, start: int, stop: int) -> Samples:
        """Return velocities [m/s], shape (samples,); lost samples are NaN."""
        values = self.recording.read(self.role, start, stop)
        if not self.between(start, stop):
            return values
        # Include neighbouring drop-outs, because the interpolation must not use samples of a drop-out.
        dropouts = self.between(max(start - _TOGETHER, 0), min(stop + _TOGETHER, self.recording.samples))
        first = max(dropouts[0].first - _CONTEXT, 0)
        last = min(dropouts[-1].stop + _CONTEXT, self.recording.samples)
        bridged_velocity = bridge(
            self.recording.read(self.role, first, last),
            tuple(Dropout(each.first - first, each.stop - first) for each in dropouts),
        )
        for each in self.between(start, stop):
            begin, end = max(each.first, start), min(each.stop, stop)
            values[begin - start : end - start] = bridged_velocity[begin - first : end - first]
        return values

    def between(self, start: int, stop: int) -> tuple[Dropout, ...]:
        """Return the drop-outs that overlap these samples."""
        rate = self.recording.sample_rate_hz
        if rate < LOWEST_RATE_HZ:
            return ()
        block, longest = round(_BLOCK_S * rate), round(LONGEST_S * rate)
        blocks = range(max(start - longest, 0) // block, -(-stop // block))
        found = (each for place in blocks for each in self._beginning_in(place, block, 2 * longest))
        return tuple(each for each in found if each.first < stop and each.stop > start)

    def _beginning_in(self, place: int, block: int, margin: int) -> tuple[Dropout, ...]:
        known = _FOUND.setdefault(self.recording, {})
        if (self.role, place) in known:
            return known[self.role, place]
        first, stop = place * block, (place + 1) * block
        begin, end = max(first - margin, 0), min(stop + margin, self.recording.samples)
        heard = find_dropouts(self.recording.read(self.role, begin, end), self.recording.sample_rate_hz)
        moved = (Dropout(each.first + begin, each.stop + begin) for each in heard)
        found = tuple(each for each in moved if first <= each.first < stop)
        if end == stop + margin:  # here the recording no longer grows
            known[self.role, place] = found
        return found
