"""Track the hidden motion: acquisition without a contact law, then Kalman filter and smoother.

Parts of the motion without a track are reported and never shown as motion.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
from scipy.ndimage import gaussian_filter1d

from vibench.sim import Specimen
from vibench.sim.engine.library import Structure
from vibench.sim.engine.run import native_engine

from ..signals import Flags, Reals, runs_of
from ._prepared_motion import ChannelNoise, PreparedMotion
from ._tracking_model import STATES, VX, StepTables, TrackedSpecimen, X, step_tables

_DIFFUSION_OF_GAP = 7e-6
"""Model error: random displacement of each mass relative to the gap, per root millisecond."""
_DIFFUSION_OF_SPEED = 2e-5
"""Random velocity of each mass relative to (gap x highest natural frequency), per root millisecond."""
_DRIFT_M_PER_S2 = 1e-3
"""Random walk of the accelerometer's slow error [m/s2] per root second."""
_ACCELERATION_EXCESS = 1.5
"""Variance of an acceleration interpolated linearly between samples, relative to a sample's."""
_IMPULSE_SHARE = 0.003
"""Relative model error of a collision's impulse."""
_SMOOTHING_S = 8e-3
"""Averaging time of squared innovations to detect the loss of a track [s]."""
LOSS_LIMIT = 8.0
"""Mean squared normalised innovation above which a track counts as lost; about 1 for a good track."""
_NOTHING = np.empty(0)
_FLIGHT = 0.0
"""Value of `FilterPredictions.kinds` for a step without contact."""


@dataclass(frozen=True, eq=False)
class MotionModel:
    """Model of specimen and channels for the filter."""

    specimen: Specimen
    tables: StepTables
    step_noise: Reals
    """Process noise Q of one sample, shape (8, 8)."""
    velocity_variance: float

    @property
    def without_stops(self) -> "MotionModel":
        """Return the model without stops, for an unknown contact force."""
        stop = self.tables.stop.copy()
        stop[:2] = np.inf
        return replace(self, tables=replace(self.tables, stop=stop))

    @property
    def gaps_m(self) -> tuple[float, float]:
        """Gaps at negative and at positive p."""
        return float(self.tables.stop[0]), float(self.tables.stop[1])


def motion_model(tracked: TrackedSpecimen, motion: PreparedMotion) -> MotionModel:
    """Build the filter's model for a motion."""
    tables = step_tables(tracked, motion.sample_rate_hz, motion.coupling_rad_per_s)
    noise = step_noise(tracked.specimen, tables, motion.noise)
    return MotionModel(tracked.specimen, tables, noise, motion.noise.velocity**2)


def step_noise(specimen: Specimen, tables: StepTables, noise: ChannelNoise) -> Reals:
    """Return Q: accelerometer noise, model error, and drift of the acceleration."""
    gap_m = min(specimen.gaps_m)
    speed = gap_m * 2.0 * np.pi * float(specimen.natural_frequencies_hz[-1])
    per_ms = tables.step_s / 1e-3
    q = np.zeros((STATES, STATES))
    places, rates = np.arange(X, VX), np.arange(VX, 2 * VX)
    q[places, places] = (_DIFFUSION_OF_GAP * gap_m) ** 2 * per_ms
    q[rates, rates] = (_DIFFUSION_OF_SPEED * speed) ** 2 * per_ms
    shaken = tables.acceleration_input
    q += _ACCELERATION_EXCESS * noise.acceleration**2 * np.outer(shaken, shaken)
    q[-1, -1] += _DRIFT_M_PER_S2**2 * tables.step_s
    return q


@dataclass(eq=False)
class FilterState:
    """State of a run of the filter, updated in place."""

    sample: int
    """Index of the last sample that the filter used, counted from the start of the motion."""
    state: Reals
    covariance: Reals
    innovation_level: float = 1.0
    """Running mean of the squared normalised innovation."""

    def copy(self) -> "FilterState":
        """Return an independent copy of this state."""
        return FilterState(self.sample, self.state.copy(), self.covariance.copy(), self.innovation_level)


@dataclass(frozen=True, eq=False)
class FilterPredictions:
    """Predictions of the filter for each sample, before that sample was used."""

    first: int
    """Index of the first predicted sample, counted from the start of the motion."""
    states: Reals
    covariances: Reals
    innovations: Reals
    """Innovation and its variance, which is 0 if the sample was not used."""
    kinds: Reals
    jacobians: Reals
    impulses: Reals

    @property
    def nis(self) -> Reals:
        """Squared normalised innovations; NaN if a sample was not used."""
        value, variance = self.innovations.T
        return np.asarray(np.where(variance > 0, value**2 / np.where(variance > 0, variance, 1.0), np.nan))

    @classmethod
    def room(cls, first: int, count: int) -> "FilterPredictions":
        """Allocate arrays for the predictions of this many samples."""
        shapes = (STATES,), (STATES, STATES), (2,), (), (STATES, STATES), ()
        return cls(first, *(np.empty((count, *shape)) for shape in shapes))

    @property
    def arrays(self) -> dict[str, Reals]:
        """Return arrays by name, in the order of `TrackRecord` in native/structures.hpp."""
        return {each.name: getattr(self, each.name) for each in fields(self)[1:]}

    def samples(self, begin: int, end: int | None = None) -> "FilterPredictions":
        """Return the predictions for samples ``begin`` to before ``end``."""
        return FilterPredictions(self.first + begin, *(each[begin:end] for each in self.arrays.values()))

    @property
    def record(self) -> Structure:
        """Return these predictions as a `TrackRecord` for the native engine."""
        return native_engine().new("TrackRecord", **self.arrays)


def run_filter(
    model: MotionModel,
    motion: PreparedMotion,
    at: FilterState,
    count: int,
    *,
    loss_limit: float = np.inf,
    force_variance: Reals = _NOTHING,
) -> FilterPredictions:
    """Advance ``at`` by ``count`` samples, or until the mean squared innovation exceeds the limit.

    ``force_variance`` is the variance of an unknown contact force held over each sample [N^2].
    """
    kept = FilterPredictions.room(at.sample + 1, min(count, motion.samples - 1 - at.sample))
    done = move_filter(
        [model.tables],
        motion,
        at,
        kept.kinds.size,
        noise=model.step_noise,
        velocity_variance=model.velocity_variance,
        loss_limit=loss_limit,
        force_variance=force_variance,
        record=kept.record,
    )
    return kept.samples(0, done)


def move_filter(
    tables: Sequence[StepTables],
    motion: PreparedMotion,
    at: FilterState,
    count: int,
    *,
    noise: Reals,
    velocity_variance: float,
    loss_limit: float,
    deviations: Reals = _NOTHING,
    force_variance: Reals = _NOTHING,
    record: Structure | None = None,
) -> int:
    """Advance ``at`` by up to ``count`` samples; return the number of samples until the track was lost.

    Each table after the first has one parameter changed by its deviation.
    """
    engine, first = native_engine(), tables[0]
    work = engine.new(
        "MotionFilter",
        acceleration=motion.accelerations(at.sample, at.sample + count + 1),
        velocity=motion.velocities(at.sample + 1, at.sample + count + 1),
        flows=np.stack([each.flow for each in tables]),
        small_flows=np.stack([each.small_flow for each in tables]),
        stops=np.stack([each.stop for each in tables]),
        deviations=deviations,
        step=first.step_s,
        small_steps=first.small_steps,
        noise=noise,
        velocity_variance=velocity_variance,
        impulse_share=_IMPULSE_SHARE,
        force_variance=force_variance if force_variance.size else np.zeros(count),
        force_input=first.force_input,
        level=at.innovation_level,
        level_share=min(1.0, first.step_s / _SMOOTHING_S),
        limit=loss_limit,
        state=at.state,
        covariance=at.covariance,
        **({} if record is None else {"record": record}),
    )
    done = engine.call("filter_motion", work)
    at.sample += done
    at.innovation_level = float(work["level"])
    return done


@dataclass(frozen=True, eq=False)
class RtsTrack:
    """A part of the motion after smoothing."""

    first: int
    states: Reals
    """Smoothed states, shape (samples, 8)."""
    variances: Reals
    """Variances of p and of its rate, shape (samples, 2)."""
    forces: Reals
    """Latent force on m1 and its variance, shape (samples, 2), if requested."""
    first_covariance: Reals
    """Covariance of the first state, shape (8, 8)."""
    touched: Flags
    """Flags of the steps with contact, shape (samples,)."""

    @property
    def p(self) -> Reals:
        """Relative displacement y - z [m]."""
        return np.asarray(self.states[:, 1] - self.states[:, 2])

    @property
    def rate(self) -> Reals:
        """Rate of change of p [m/s]."""
        return np.asarray(self.states[:, 4] - self.states[:, 5])


def smooth(model: MotionModel, run: FilterPredictions, force_variance: Reals = _NOTHING) -> RtsTrack:
    """Smooth a run of the filter backwards in time."""
    count = run.states.shape[0]
    states, variances = np.empty((count, STATES)), np.empty((count, 2))
    forces, matrix = np.empty((force_variance.size, 2)), np.empty((STATES, STATES))
    engine = native_engine()
    work = engine.new(
        "MotionSmoother",
        record=run.record,
        flow=model.tables.flow,
        force_variance=force_variance,
        force_input=model.tables.force_input,
        states=states,
        variances=variances,
        forces=forces,
        matrix=matrix,
    )
    engine.call("smooth_motion", work)
    covariance = run.covariances[0] if count else np.empty((STATES, STATES))
    return RtsTrack(
        run.first,
        states,
        variances,
        forces,
        covariance - covariance @ matrix @ covariance,
        run.kinds != _FLIGHT,
    )


_PEAK_BAND_HZ = 4500.0
"""Bandwidth in which peaks of the force are sought: a compromise between short collisions and noise."""
_WINDOW_S = 6e-5
"""Half width of a window around a peak of the contact force [s]."""
_PEAK_OVER_MEDIAN = 6.0
_LEAST_PEAK = 0.1
"""Smallest peak of the force at an impact, relative to the first guess of the force."""
CLOSED_SHARE = 3e-4
"""Standard deviation of the force between impacts, relative to the first guess of the force."""
_LEAST_GUESS_N = 1e-3
_SURPRISE = 25.0
"""Squared normalised innovation from which an impact counts as overlooked."""
_MEDIAN_OF_SQUARE = 0.455
"""Median of the square of a standard normal variable."""
_RERUNS = 3
_START_UP_S = 4e-3
"""Start-up time of the filter, in which innovations are ignored [s]."""
_START_SD = (1e-4, 0.3, 1.0, 0.5)
"""Initial standard deviations of displacements, velocities, base velocity W and acceleration error B."""


@dataclass(frozen=True, eq=False)
class LatentMotion:
    """A part of a motion smoothed without a contact law."""

    run: FilterPredictions
    smoothed: RtsTrack
    is_open: Flags
    """Flags of samples with a possible contact force."""
    is_dropout: Flags
    """Flags of samples in or near drop-outs; drop-outs may hide a contact."""
    force_variance: Reals
    misfit: float
    """Mean of the squared normalised innovations without the largest 0.1 %; 1 for a good fit."""


def latent_motion(
    model: MotionModel, motion: PreparedMotion, first: int, count: int, closed_share: float = CLOSED_SHARE
) -> LatentMotion:
    """Smooth ``count`` samples after sample ``first`` without a contact law.

    A larger ``closed_share`` allows more force between impacts, which tolerates wrong specimen parameters.
    """
    free = model.without_stops
    # As a guess, the force is m1 times three times the rms acceleration of m0.
    velocity = motion.velocity[first : first + count + 1].astype(np.float64)
    smooth_v = gaussian_filter1d(velocity, motion.sample_rate_hz / (2 * np.pi * _PEAK_BAND_HZ))
    rms = float(np.std(np.diff(smooth_v))) * motion.sample_rate_hz
    guess_n = max(model.specimen.masses[1] * 3.0 * rms, _LEAST_GUESS_N)
    variance = np.full(count, guess_n**2)
    run, smoothed = _filter_and_smooth(free, motion, first, variance)
    # During a drop-out, m1 may have struck a stop without a trace.
    is_dropout = _widen_marks(motion.is_dropout[first + 1 : first + count + 1], motion.sample_rate_hz)
    windows = _peaks(smoothed.forces[:, 0], guess_n, motion.sample_rate_hz) | is_dropout
    closed = (closed_share * guess_n) ** 2
    variance = np.where(windows, (6.0 * guess_n) ** 2, closed)
    for _ in range(_RERUNS):
        run, smoothed = _filter_and_smooth(free, motion, first, variance)
        windows, surprised = _with_surprises(windows, run, motion.sample_rate_hz)
        following = _learnt(windows, smoothed.forces, guess_n, closed)
        settled = not surprised and np.allclose(following, variance, rtol=0.5)
        if settled:
            break
        variance = following
    squared = run.nis[_start_up(motion.sample_rate_hz, count) :]
    squared = np.sort(squared[~np.isnan(squared)])
    misfit = float(np.mean(squared[: int(0.999 * squared.size) or 1])) if squared.size else np.inf
    return LatentMotion(run, smoothed, windows, is_dropout, variance, misfit)


def latent_start(first: int) -> FilterState:
    """Return an unknown initial state at sample ``first``: zero with a wide covariance."""
    place, rate, base, error = _START_SD
    return FilterState(first, np.zeros(STATES), np.diag([place**2] * 3 + [rate**2] * 3 + [base**2, error**2]))


def _filter_and_smooth(
    model: MotionModel, motion: PreparedMotion, first: int, variance: Reals
) -> tuple[FilterPredictions, RtsTrack]:
    run = run_filter(model, motion, latent_start(first), variance.size, force_variance=variance)
    return run, smooth(model, run, variance)


def _widen_marks(marks: Flags, sample_rate_hz: float) -> Flags:
    width = 2 * max(1, round(_WINDOW_S * sample_rate_hz)) + 1
    return np.asarray(np.convolve(marks, np.ones(width), "same") > 0.5)


def _peaks(force: Reals, guess_n: float, sample_rate_hz: float) -> Flags:
    size = np.abs(gaussian_filter1d(force, sample_rate_hz / (2.0 * np.pi * _PEAK_BAND_HZ)))
    threshold = max(_PEAK_OVER_MEDIAN * float(np.median(size)), _LEAST_PEAK * guess_n)
    marks = np.zeros(size.size, dtype=np.bool_)
    inner = size[1:-1]
    marks[1:-1] = (inner > threshold) & (inner >= size[:-2]) & (inner > size[2:])
    return _widen_marks(marks, sample_rate_hz)


def _start_up(sample_rate_hz: float, count: int) -> int:
    return min(round(_START_UP_S * sample_rate_hz), count // 4)


def _with_surprises(windows: Flags, run: FilterPredictions, sample_rate_hz: float) -> tuple[Flags, bool]:
    """Add a window just before every innovation that shows an overlooked impact."""
    squared = run.nis
    # Wrong parameters raise all innovations, so only outliers count as impacts.
    usual = max(1.0, float(np.nanmedian(squared)) / _MEDIAN_OF_SQUARE)
    surprise = squared > _SURPRISE * usual
    surprise[: _start_up(sample_rate_hz, surprise.size)] = False
    onsets = surprise & ~np.concatenate(([False], surprise[:-1]))
    earlier = np.concatenate((onsets[1:], [False]))
    added = _widen_marks(earlier, sample_rate_hz) & ~windows
    return np.asarray(windows | added), bool(added.any())


def _learnt(windows: Flags, forces: Reals, guess_n: float, closed: float) -> Reals:
    """Return the force variance: mean square force of each window, as in expectation maximisation."""
    begins, ends = runs_of(windows).T
    squares = np.concatenate(([0.0], np.cumsum(forces[:, 0] ** 2 + forces[:, 1])))
    found = np.maximum((squares[ends] - squares[begins]) / (ends - begins), guess_n**2)
    variance = np.full(windows.size, closed)
    variance[windows] = np.repeat(found, ends - begins)
    return variance


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
        """Index one past the last tracked sample, counted from the start of the motion."""
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
        # Start the next 60 ms so that their middle third begins where the track ended.
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
            found = smooth(model, whole.samples(0, kept) if is_lost else whole)
            parts = {name: getattr(found, name)[:kept] for name in ("states", "variances", "touched")}
            yield TrackedPiece(replace(found, **parts), run.samples(0, kept))
        if is_lost:
            return


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
