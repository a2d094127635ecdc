"""Track the hidden motion: acquisition without a contact law, then filter and smoother.

Parts of the motion without a track are reported and never shown as motion.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from ..signals.arrays import Flags
from ._filtering import (
    LOSS_LIMIT,
    FilterPredictions,
    FilterState,
    MotionModel,
    RtsTrack,
    run_filter,
    smooth,
)
from ._latent_force import latent_motion
from ._prepared_motion import PreparedMotion

ACQUISITION_S = 0.06
"""Length of motion from which a track is started [s]."""
_WORST_MISFIT = 3.0
"""Largest misfit of an acquisition that may start a track."""
_ACQUIRED_EXCESS = 4.0
"""Factor on the covariance after acquisition, because the filter uses the same samples again."""
_FLIGHT_MARGIN_S = 8e-5
"""Shortest flight before and after the first sample of a track [s]."""
_PIECE_S = 0.25
"""Length of motion that is filtered and smoothed at once [s]."""
_OVERLAP_S = 0.02
"""Length of motion filtered beyond a piece to smooth its end [s]; several times the filter's memory."""
_GOOD = 2.5
"""Largest mean squared innovation over `_LOOK_S` in the valid part of a lost track."""
_LOOK_S = 4e-3
_WORST_SD_OF_GAP = 0.1
"""Largest standard deviation of p at the start of a track, relative to the gap."""


@dataclass(frozen=True, eq=False)
class TrackedPiece:
    """Consecutive samples of a motion that were tracked."""

    smoothed: RtsTrack
    run: FilterPredictions
    """Run of the filter over these samples."""

    @property
    def first(self) -> int:
        """Index of the first tracked sample, counted from the start of the motion."""
        return self.smoothed.first

    @property
    def stop(self) -> int:
        """Index after the last tracked sample, counted from the start of the motion."""
        return self.first + int(self.smoothed.states.shape[0])


@dataclass(frozen=True)
class TrackGap:
    """A stretch without a track, and the reason."""

    first: int
    stop: int
    reason: str


def acquire(model: MotionModel, motion: PreparedMotion, first: int) -> FilterState | str:
    """Start a track in the middle third of the 60 ms after a sample; return the reason if this fails."""
    count = min(round(ACQUISITION_S * motion.sample_rate_hz), motion.samples - 1 - first)
    if count < round(ACQUISITION_S * motion.sample_rate_hz):
        return f"fewer than {1e3 * ACQUISITION_S:.0f} ms of motion were left to begin a track"
    found = latent_motion(model, motion, first, count)
    if not found.misfit < _WORST_MISFIT:
        return (
            f"the residual of the specimen's equations is over {_WORST_MISFIT:g} times the noise of the "
            "channels, even with a free contact force"
        )
    begin = _calmest(model, found.smoothed, found.is_open, motion.sample_rate_hz)
    if begin is None:
        return "no motion between two impacts was determined well enough to begin a track"
    ahead = smooth(model.without_stops, found.run.samples(begin), found.force_variance[begin:])
    return FilterState(ahead.first, ahead.states[0].copy(), _ACQUIRED_EXCESS * ahead.first_covariance)


def _calmest(model: MotionModel, smoothed: RtsTrack, is_open: Flags, sample_rate_hz: float) -> int | None:
    """Return the flight sample in the middle third with the least uncertain p; None if all are uncertain."""
    count = is_open.size
    margin = max(1, round(_FLIGHT_MARGIN_S * sample_rate_hz))
    near = np.convolve(is_open, np.ones(2 * margin + 1), "same") > 0.5
    lower, upper = model.gaps_m
    allowed = ~near & (smoothed.p < upper) & (smoothed.p > -lower)
    allowed[: count // 3] = allowed[2 * count // 3 :] = False
    if not allowed.any():
        return None
    variance = np.where(allowed, smoothed.variances[:, 0], np.inf)
    best = int(np.argmin(variance))
    if variance[best] > (_WORST_SD_OF_GAP * min(lower, upper)) ** 2:
        return None
    return best


def follow(
    model: MotionModel,
    motion: PreparedMotion,
    on_sample: Callable[[int], None] = lambda _sample: None,
) -> Iterator[TrackedPiece | TrackGap]:
    """Track a motion; yield tracked pieces and the stretches between them in the order of time."""
    window = round(ACQUISITION_S * motion.sample_rate_hz)
    last = motion.samples - 1 - window
    looked, done = 0, 0
    while looked <= last and done < motion.samples - 1:
        start = acquire(model, motion, looked)
        match start:
            case str():
                stop = min(looked + 2 * (window // 3), motion.samples)
                yield TrackGap(done, stop, start)
                done = stop
            case FilterState():
                began = start.sample
                is_caught_up = _advance_to(model, motion, start, done)
                pieces = _pieces(model, motion, start) if is_caught_up else iter(())
                piece = next(pieces, None)
                if began > done:
                    why = "a track was being acquired" if piece else "a track was lost at its beginning"
                    yield TrackGap(done, began, why)
                    done = began
                while piece:
                    yield piece
                    done = piece.stop
                    on_sample(done)
                    piece = next(pieces, None)
        # The middle third of the next 60 ms starts where the track ended.
        following = max(done - window // 3, looked + window // 3)
        looked = last if looked < last < following else following
        on_sample(done)
    if done < motion.samples:
        yield TrackGap(done, motion.samples, "too few samples were left to begin a track")


def _advance_to(model: MotionModel, motion: PreparedMotion, at: FilterState, sample: int) -> bool:
    """Advance a state to a later sample; return False if the track was lost."""
    count = sample - at.sample
    if count <= 0:
        return True
    run_filter(model, motion, at, count, loss_limit=LOSS_LIMIT)
    return at.sample == sample


def _pieces(model: MotionModel, motion: PreparedMotion, at: FilterState) -> Iterator[TrackedPiece]:
    """Track from a state until the motion ends or the track is lost."""
    length = round(_PIECE_S * motion.sample_rate_hz)
    overlap = round(_OVERLAP_S * motion.sample_rate_hz)
    while at.sample < motion.samples - 1:
        left = motion.samples - 1 - at.sample
        count = left if left <= length + overlap else length
        ahead = min(overlap, left - count)
        run = run_filter(model, motion, at, count, loss_limit=LOSS_LIMIT)
        is_lost = run.states.shape[0] < count
        kept = reliable_samples(run, motion.sample_rate_hz) if is_lost else count
        whole = run
        if ahead and not is_lost:
            beyond = run_filter(model, motion, at.copy(), ahead)
            pairs = zip(run.arrays.values(), beyond.arrays.values(), strict=True)
            whole = FilterPredictions(run.first, *(np.concatenate(pair) for pair in pairs))
        if kept:
            seen = whole.samples(0, kept) if is_lost else whole
            yield _piece(smooth(model, seen), run, kept)
        if is_lost:
            return


def _piece(smoothed: RtsTrack, run: FilterPredictions, kept: int) -> TrackedPiece:
    return TrackedPiece(
        replace(
            smoothed,
            states=smoothed.states[:kept],
            variances=smoothed.variances[:kept],
            touched=smoothed.touched[:kept],
        ),
        run.samples(0, kept),
    )


def reliable_samples(run: FilterPredictions, sample_rate_hz: float) -> int:
    """Return the number of samples up to the last good innovations in a run that lost the track."""
    squared = run.nis
    used = ~np.isnan(squared)
    width = max(1, round(_LOOK_S * sample_rate_hz))
    total = np.convolve(np.where(used, squared, 0.0), np.ones(width))[: squared.size]
    number = np.convolve(used, np.ones(width))[: squared.size]
    good = total <= _GOOD * np.maximum(number, 1.0)
    last = np.flatnonzero(good)
    return max(0, int(last[-1]) + 1 - width) if last.size else 0
