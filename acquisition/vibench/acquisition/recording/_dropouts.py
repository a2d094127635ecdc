"""Moments in which the vibrometer lost its light: found in the velocity, and bridged from both sides.

Speckle leaves the laser without light for a fraction of a millisecond; the decoder then shows any velocity.
It leaves the motion within a sample and comes back to it. No motion does: an impact changes the velocity and
does not take that back, and what rings has many turns.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lstsq, toeplitz

from ..instruments import Samples
from ._reader import Recording

Places = NDArray[np.int64]

LONGEST_S = 4e-3
"""What is longer is no drop-out that the motion on both sides tells anything of."""
LOWEST_RATE_HZ = 20_000.0
"""Below it an impact and its answer may lie within a few samples."""
_FAR = 60.0
"""How far the fourth difference lies from its usual size where light is lost."""
_HEARD = 6.0
"""How far it lies where the converter's filter still rings of it."""
_SILENT = 6
_QUIET_S = 2.5e-4
"""Between two runs of sharp corners, which may be edges of one drop-out or of two."""
_MOST_RUNS = 12
"""Close to each other; this many corners are made by the motion."""
_FLANK_S = 1e-3
"""Length of motion on either side by which a drop-out is recognised."""
_LEAST_HELD = 8
"""Equal samples in a row that no motion shows between two changes of `_QUANTA`."""
_QUANTA = 4.0
"""Change from sample to sample, over the smallest of the channel, at both ends of equal samples."""
_LEAST_OF_FLANK = 0.25
"""Part of it that another drop-out close by must leave."""
DROPOUTS_TOLD_AFTER_S = LONGEST_S + 2.0 * _FLANK_S
"""Length of motion behind a sample that tells whether it was measured."""
_OUTSTANDING = 8.0
"""Largest distance from the bridge, over what the bridge's fit leaves of the flanks."""
_JUMP = 4.0
"""Change from sample to sample where light goes, over the fastest of the flanks."""
_STEEP = 0.2
"""The same change over the largest distance from the bridge: between clipped peaks a motion takes longer."""
_MOST_PER_S = 400.0
"""What comes more often is made by the motion."""
_ORDER = 48
_CONTEXT = 12 * _ORDER
"""Samples on each side that the linear prediction is taken from."""
_TOGETHER = 4 * _CONTEXT
"""Samples that are solved for at once."""
_BLOCK_S = 1.0


class Dropout(NamedTuple):
    """Samples that show no motion, the converter's ringing about them included."""

    first: int
    stop: int
    """One past the last."""


def found_dropouts(velocity: Samples, sample_rate_hz: float) -> tuple[Dropout, ...]:
    """Find what leaves the motion and comes back to it.

    Parameters
    ----------
    velocity
        A second of it or so, shape (samples,); lost samples are NaN.
    sample_rate_hz
        Of the samples; nothing is found below 20 kHz.
    """
    flank = round(_FLANK_S * sample_rate_hz)
    if sample_rate_hz < LOWEST_RATE_HZ or velocity.size < 4 * flank:
        return ()
    longest = LONGEST_S * sample_rate_hz
    found = _held(velocity, longest)
    velocity = bridged(velocity, tuple(found))
    sharp, usual = _corners(velocity)
    rings, far = sharp > _HEARD * usual, np.flatnonzero(sharp > _FAR * usual)

    def explained(edges: Places) -> tuple[Dropout, ...]:
        runs = [
            Dropout(
                int(run[0]) - _ringing(rings[run[0] :: -1], flank) - 2,
                int(run[-1]) + _ringing(rings[run[-1] :], flank) + 3,
            )
            for run in _apart(edges, _QUIET_S * sample_rate_hz)
        ]
        return _explain(velocity, runs, flank, longest) if len(runs) <= _MOST_RUNS else ()

    for edges in _apart(far, longest) if far.size else ():
        together = explained(edges)
        for each in [] if together else _apart(edges, flank):
            together += explained(each)
        found += together
    return _join(sorted(found), flank) if len(found) <= _MOST_PER_S * velocity.size / sample_rate_hz else ()


def _held(velocity: Samples, longest: float) -> list[Dropout]:
    """Find where the decoder holds one value; noise may hide the edges of such a drop-out."""
    change = np.abs(np.diff(velocity))
    moves = np.flatnonzero(change != 0.0)
    first, last, equal = moves[:-1], moves[1:], np.diff(moves)
    steep = change > _QUANTA * np.min(change, where=change > 0.0, initial=np.inf)
    # A clipped peak is held too, at the largest value.
    is_inside = np.abs(velocity[last]) < np.fmax.reduce(np.abs(velocity))
    held = (equal >= _LEAST_HELD) & (equal <= longest) & steep[first] & steep[last] & is_inside
    ends = zip(first[held].tolist(), last[held].tolist(), strict=True)
    return [Dropout(max(begin - 1, 0), end + 3) for begin, end in ends]


def _join(found: Sequence[Dropout], flank: int) -> tuple[Dropout, ...]:
    """Join drop-outs that leave less than a flank between them: what lies there may be dark as well."""
    joined: list[Dropout] = []
    for each in found:
        if joined and each.first - joined[-1].stop < flank:
            joined[-1] = Dropout(joined[-1].first, max(joined[-1].stop, each.stop))
        else:
            joined.append(each)
    return tuple(joined)


def undecided_from(velocity: Samples, sample_rate_hz: float, dropouts: tuple[Dropout, ...]) -> int:
    """Say from which sample on only what comes will tell whether a drop-out has started; else their number.

    Parameters
    ----------
    velocity
        Shape (samples,), of a channel that goes on.
    sample_rate_hz
        Of the samples.
    dropouts
        Those found in it.
    """
    if sample_rate_hz < LOWEST_RATE_HZ or velocity.size < 5:
        return velocity.size
    sharp, usual = _corners(velocity)
    far = np.flatnonzero(sharp > _FAR * usual)
    far = far[far >= velocity.size - round(DROPOUTS_TOLD_AFTER_S * sample_rate_hz)]
    known = np.zeros(velocity.size, dtype=np.bool_)
    for each in dropouts:
        known[each.first : each.stop] = True
    open_ones = far[~known[far]]
    return max(int(open_ones[0]) - round(_FLANK_S * sample_rate_hz), 0) if open_ones.size else velocity.size


def _corners(velocity: Samples) -> tuple[Samples, float]:
    """Return fourth differences, in which sharp corners stand out, and their median; infinite for zero."""
    sharp = np.zeros(velocity.size)
    sharp[2:-2] = np.abs(np.diff(velocity, 4))
    return sharp, float(np.nanmedian(sharp)) or np.inf


def _apart(places: Places, distance: float) -> list[Places]:
    """Split where neighbours are farther apart."""
    return np.split(places, np.flatnonzero(np.diff(places) > distance) + 1)


def _explain(velocity: Samples, runs: Sequence[Dropout], flank: int, longest: float) -> tuple[Dropout, ...]:
    """Explain all of these runs of sharp corners by drop-outs, or none of them.

    By the fewest, and of those by the ones about which the motion is smoothest: between the edges of two a
    dark level looks like a motion as well.
    """
    ends = [0, *(each.stop for each in runs)]
    begins = [*(each.first for each in runs), velocity.size]
    best: list[tuple[int, float, tuple[Dropout, ...]] | None] = [(0, 0.0, ())]
    for last in range(1, len(runs) + 1):
        ways = []
        for first, so_far in enumerate(best):
            one = Dropout(begins[first], ends[last])
            # What is next to it is no motion to compare with.
            before, after = min(flank, one.first - ends[first]), min(flank, begins[last] - one.stop)
            is_alone = min(before, after) >= flank * _LEAST_OF_FLANK
            is_short = one.stop - one.first <= longest + flank  # with what rings on both sides
            if so_far is not None and is_alone and is_short:
                rough = _roughness(velocity, one, before, after)
                if rough < np.inf:
                    ways.append((so_far[0] + 1, so_far[1] + rough, (*so_far[2], one)))
        best.append(min(ways, default=None))
    return best[-1][2] if best[-1] else ()


def _ringing(rings: NDArray[np.bool_], longest: int) -> int:
    """For how many samples from here on the converter's filter is heard, `_SILENT` of them in a row not."""
    heard = np.flatnonzero(rings[:longest])
    breaks = np.flatnonzero(np.diff(heard) > _SILENT)
    return int(heard[breaks[0]] if breaks.size else heard[-1])


def _roughness(velocity: Samples, dropout: Dropout, before: int, after: int) -> float:
    """Say what one smooth motion through both flanks leaves of them, mean square; infinite for no drop-out.

    What lies between jumps far from that motion. A clipped peak is far from it too, and gets there at the
    motion's own pace.
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
    left = near - shape @ lstsq(shape[outside], near[outside])[0]
    rough = float(np.mean(left[outside] ** 2))
    distance = np.max(np.abs(left[~outside]))
    is_far = distance**2 > _OUTSTANDING**2 * rough
    is_steep = np.max(pace[before:-after]) > _STEEP * distance
    return rough if is_far and is_steep else np.inf


def bridged(velocity: Samples, dropouts: tuple[Dropout, ...]) -> Samples:
    """Return the velocity, shape (samples,), with what a linear prediction makes likeliest in drop-outs.

    Janssen, Veldhuis and Vries 1986, IEEE Trans. ASSP 34, 317-330: the unknown samples with the smallest
    prediction error, for a predictor from the samples about them.

    Parameters
    ----------
    velocity
        Shape (samples,); it is left as it is.
    dropouts
        As `found_dropouts` gives them.
    """
    mended, hidden = velocity.copy(), np.zeros(velocity.size, dtype=np.bool_)
    for each in dropouts:
        hidden[each.first : each.stop] = True
    for first, stop, behind in _together(dropouts, velocity.size):
        near = slice(max(first - _CONTEXT, 0), min(stop + _CONTEXT, behind))
        if np.all(np.isfinite(mended[near][~hidden[near]])):
            mended[near] = _likeliest(mended[near], ~hidden[near])
        hidden[:stop] = False
    return mended


def _together(dropouts: tuple[Dropout, ...], samples: int) -> Iterator[tuple[int, int, int]]:
    """Yield begin and end of drop-outs that lie close together, and where the next begin."""
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
    """Solve for the samples that are not known, given a predictor from the others, if those are enough."""
    mean = float(np.mean(near[known]))
    values = np.where(known, near - mean, 0.0)
    windows, whole = (np.lib.stride_tricks.sliding_window_view(each, _ORDER + 1) for each in (values, known))
    past, now = np.split(windows[whole.all(axis=1)], [_ORDER], axis=1)
    if len(past) < 2 * _ORDER:
        return near
    predictor = lstsq(past, now[:, 0])[0]
    # Prediction errors of all windows, as a band matrix times the samples.
    row, column = np.zeros(near.size), np.zeros(near.size - _ORDER)
    row[: _ORDER + 1] = np.append(-predictor, 1.0)
    column[0] = row[0]
    errors = toeplitz(column, row)
    values[~known] = lstsq(errors[:, ~known], -errors @ values)[0]
    return mean + values


_FOUND: WeakKeyDictionary[Recording, dict[tuple[str, int], tuple[Dropout, ...]]] = WeakKeyDictionary()
"""What was found in each second of an open recording: facts, estimators and tracks ask for the same."""


@dataclass(frozen=True, eq=False)
class BridgedChannel:
    """The vibrometer's channel of a recording without its drop-outs.

    They are looked for in seconds counted from the first sample, so that whatever is read says the same.
    """

    recording: Recording
    role: str

    def read(self, start: int, stop: int) -> Samples:
        """Return velocities [m/s], shape (samples,); lost samples are NaN."""
        values = self.recording.read(self.role, start, stop)
        if not self.between(start, stop):
            return values
        # With their neighbours, which are no context to learn from.
        dropouts = self.between(max(start - _TOGETHER, 0), min(stop + _TOGETHER, self.recording.samples))
        first = max(dropouts[0].first - _CONTEXT, 0)
        last = min(dropouts[-1].stop + _CONTEXT, self.recording.samples)
        mended = bridged(
            self.recording.read(self.role, first, last),
            tuple(Dropout(each.first - first, each.stop - first) for each in dropouts),
        )
        for each in self.between(start, stop):
            begin, end = max(each.first, start), min(each.stop, stop)
            values[begin - start : end - start] = mended[begin - first : end - first]
        return values

    def between(self, start: int, stop: int) -> tuple[Dropout, ...]:
        """Return the drop-outs that reach into these samples."""
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
        heard = found_dropouts(self.recording.read(self.role, begin, end), self.recording.sample_rate_hz)
        moved = (Dropout(each.first + begin, each.stop + begin) for each in heard)
        found = tuple(each for each in moved if first <= each.first < stop)
        if end == stop + margin:  # else a recording that grows may tell more
            known[self.role, place] = found
        return found
