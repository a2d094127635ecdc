"""Analysis of a recorded sweep: responses, collision regions, jumps, hysteresis, and a spectrogram."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import ClassVar, TypeVar

import numpy as np
from scipy.ndimage import binary_opening, maximum_filter1d, uniform_filter1d

from vibench.acquisition.plan import HeldSweep, SineSweep
from vibench.acquisition.recording import SegmentLabel
from vibench.sim import Specimen, base_transmissibility

from ..errors import InvalidRequest, NotEnoughData, UnusableData
from ..recordings.channels import RecordedChannels, only_stretch
from ..recordings.checks import AbstractAnalysis, Check, Verdict
from ..signals import PER_NEPER_DB, Flags, Reals, runs_of
from ..spectra import Spectrogram, SpectrogramSums
from ..tables import Tabular
from .dwell import LEAST_CLEAR
from .sweep import DrivePhase, SweepResponse, SweepSums, SweptMotion, Transmission

_SIDE = 12
"""Number of intervals on each side to which a straight line is fitted."""
_SMALLEST_DB = 1.5
_CLEAR = 8.0
"""Minimum size of a jump [standard errors], since thousands of steps with roughly known errors are tested."""
_LIKELY = 3.84
"""Twice the log likelihood ratio at 95 % (chi squared, one degree of freedom)."""
_TRANSITION = 3
"""Number of intervals within the jump itself, which belong to neither side."""
_DEGREE, _EXPLAINED = 4, 0.06
"""Degree of the polynomial fitted to 1/response squared at a resonance, and its largest residual relative to
the step. A jump leaves a residual of 0.13 or more; 400 resonances left at most 0.03."""
_LARGER = 2.0
"""Minimum ratio of a jump to the largest step near it in the response of the linear specimen."""


@dataclass(frozen=True)
class Jump:
    """Jump of a response in a sweep."""

    DOCUMENT: ClassVar = "frequency_hz lower_hz upper_hz time_s before after decibel"

    frequency_hz: float
    lower_hz: float
    upper_hz: float
    """95 % bounds of the frequency of the jump, including the neighbouring intervals."""
    time_s: float
    before: float
    after: float
    """Response before and after the jump, in the order of time."""
    standard_errors: float
    """Size of the jump in ln(response), divided by its standard error."""

    @property
    def decibel(self) -> float:
        """Size of the step [dB]; positive if the response grows with time."""
        return float(20 * np.log10(self.after / self.before))


def jumps(
    time_s: Reals,
    frequency_hz: Reals,
    response: Reals,
    smooth: Flags | None = None,
    linear: Reals | None = None,
) -> tuple[Jump, ...]:
    """Return the jumps of a response over time.

    Before and after each interval, a straight line is fitted to the logarithm of the response. A jump is a
    local maximum of the difference between both lines, of at least 1.5 dB and 8 standard errors. Resonances
    of a linear specimen, which are steep and ring in a fast sweep, are excluded. The position of a jump
    maximises the likelihood; its bounds come from the likelihood ratio.

    Parameters
    ----------
    time_s, frequency_hz, response
        In the order of time, shape (intervals,); the response must be positive.
    smooth
        Intervals with smooth motion, by default all. At least one side of a jump must be smooth, because a
        chaotic response fluctuates without jumps.
    linear
        Response of the linear specimen in the same sweep, positive, if known. A jump must be twice as large
        as any step of this response nearby.
    """
    if not time_s.shape == frequency_hz.shape == response.shape:
        raise InvalidRequest(
            f"times {time_s.shape}, frequencies {frequency_hz.shape} and responses {response.shape} "
            "must be equally long"
        )
    allowed = np.ones(time_s.shape, dtype=np.bool_) if smooth is None else smooth
    logarithm = _logarithm(response)
    size, error = _steps(logarithm)
    clear = (np.abs(size) * PER_NEPER_DB >= _SMALLEST_DB) & (np.abs(size) >= _CLEAR * error)
    explained = np.zeros_like(size) if linear is None else _steps(_logarithm(linear))[0]
    found = []
    for place in _peaks(np.where(clear, np.abs(size), 0.0)):
        near = slice(max(0, place - _SIDE), place + _SIDE)
        before = allowed[max(0, place - _SIDE) : max(0, place - _TRANSITION)]
        after = allowed[place + _TRANSITION : place + _SIDE]
        is_linear = _LARGER * np.abs(explained[near]).max() > abs(size[place])
        if not (before.all() or after.all()) or is_linear or _is_resonance(logarithm, place, size[place]):
            continue
        low, best, high = _likely(logarithm[near])
        first = near.start
        found.append(_jump((first + low, first + best, first + high), time_s, frequency_hz, logarithm))
    return tuple(found)


def _logarithm(response: Reals) -> Reals:
    return np.asarray(np.log(np.maximum(response, np.finfo(np.float64).tiny)))


def _steps(logarithm: Reals) -> tuple[Reals, Reals]:
    """Return the step at each interval, from the line fitted before to the line fitted after, with errors."""
    count = logarithm.size
    size, error = np.zeros(count), np.full(count, np.inf)
    ahead = np.arange(_SIDE) + _TRANSITION / 2
    # Weights with which a line fitted to (ahead, y) gives the value at zero, and the value's variance.
    basis = np.column_stack((np.ones(_SIDE), ahead))
    solver = np.linalg.pinv(basis)
    variance = float(np.linalg.inv(basis.T @ basis)[0, 0])
    places = np.arange(_SIDE + _TRANSITION, count - _SIDE - _TRANSITION)
    away = _TRANSITION // 2 + np.arange(_SIDE)
    sides = np.stack((logarithm[places[:, None] + away], logarithm[places[:, None] - 1 - away]))
    lines = sides @ solver.T
    scatter = np.sum((sides - lines @ basis.T) ** 2, axis=-1) / (_SIDE - 2)
    size[places] = lines[0, :, 0] - lines[1, :, 0]
    error[places] = np.sqrt(variance * scatter.sum(axis=0)) + np.finfo(np.float64).eps
    return size, error


def _is_resonance(logarithm: Reals, place: int, step: float) -> bool:
    """Return whether a resonance explains a step: 1/response squared follows a smooth polynomial."""
    near = logarithm[max(0, place - _SIDE - _TRANSITION) : place + _SIDE + _TRANSITION]
    square = np.exp(2 * (near.max() - near))
    basis = np.vander(np.linspace(-1.0, 1.0, near.size), _DEGREE + 1) / square[:, np.newaxis]
    solution, *_ = np.linalg.lstsq(basis, np.ones(near.size))
    left = (basis @ solution - 1) / 2
    return bool(np.sqrt(np.sum(left**2) / (near.size - _DEGREE - 1)) < _EXPLAINED * abs(step))


def _peaks(size: Reals) -> list[int]:
    """Return the index of the largest step in each neighbourhood."""
    left = size.copy()
    found = []
    while left.max(initial=0.0) > 0.0:
        place = int(np.argmax(left))
        found.append(place)
        left[max(0, place - _SIDE) : place + _SIDE + 1] = 0.0
    return sorted(found)


def _likely(logarithm: Reals) -> tuple[int, int, int]:
    """Return lower bound, best value and upper bound of the index at which one level changes to another."""
    count = logarithm.size
    misfit = np.full(count, np.inf)
    for place in range(2, count - 1):
        before, after = logarithm[:place], logarithm[place:]
        misfit[place] = before.size * before.var() + after.size * after.var()
    best = int(np.argmin(misfit))
    ratio = count * np.log(misfit / max(misfit[best], np.finfo(np.float64).tiny))
    likely = np.flatnonzero(ratio <= _LIKELY)
    return int(likely[0]), best, int(likely[-1])


def _jump(places: tuple[int, int, int], time_s: Reals, frequency_hz: Reals, logarithm: Reals) -> Jump:
    best = places[1]
    between = [0.5 * float(frequency_hz[each - 1] + frequency_hz[each]) for each in places]
    # The jump lies at a boundary between two intervals, within half an interval on either side.
    half = 0.5 * abs(float(frequency_hz[best] - frequency_hz[best - 1]))
    size, error = _steps(logarithm[max(0, best - 2 * _SIDE) : best + 2 * _SIDE])
    at = best - max(0, best - 2 * _SIDE)
    before = float(np.exp(np.median(logarithm[max(0, best - 1 - _TRANSITION) : best - 1])))
    after = float(np.exp(np.median(logarithm[best + 1 : best + 1 + _TRANSITION])))
    return Jump(
        frequency_hz=between[1],
        lower_hz=min(between) - half,
        upper_hz=max(between) + half,
        time_s=0.5 * float(time_s[best - 1] + time_s[best]),
        before=before,
        after=after,
        standard_errors=float(abs(size[at]) / error[at]) if 0 < at < size.size else 0.0,
    )


_NOISE_FACTOR = 4.0
"""Minimum ratio of the residual to noise; an rms over hundreds of samples scatters by only a few per cent."""
_DISTORTION = 0.02
"""Largest residual of a smooth motion relative to order 1, due to high harmonics of amplifier and shaker."""
_RINGING = 2.0
"""Minimum ratio of the residual to the residual in a simulation of the sweep without contact."""
_TOO_FAST = 0.5
"""Residual relative to order 1 that collisions usually exceed; larger ringing can hide collisions."""
_IMPACTS = 0.1
"""Minimum ratio of order 2 or 3 to order 1 that shows impacts; between modes, ringing causes at most 0.05."""
_RING_CYCLES = 5_000.0
"""Number of cycles in which a mode with a damping ratio of 0.02 % decays to 1/500."""
_ENOUGH = 0.25
"""Minimum fraction of a region in which orders 2 and 3 show impacts; required if no specimen is known."""
_SMOOTH_AT_MOST = 0.1
"""Residual relative to order 1 above which a motion is never smooth."""
_QUIET_QUANTILE = 0.1
_CLEARLY = 2.0
"""Ratio of residual to threshold above which collisions are certain."""
_RISE = 1.2
"""Ratio of the residual to the previous interval's residual above which impacts must be the cause."""
_ALONE = 10.0
"""Ratio of the residual to noise, distortion and ringing above which one interval may have impacts."""
_UNLIKE = 2.0
"""If Response II differs by this factor from the value without contact, an interval may have impacts."""
_QUIET = 0.7
"""Ratio of the residual to noise, distortion and ringing below which an interval has no impacts."""
_VOTE_S = 1.0
"""Time around an interval; most intervals in it must exceed the threshold, because collisions persist."""
_MERGE_S = 3.0
"""Quiet intervals shorter than this do not split a region: motion may settle briefly between impacts."""


@dataclass(frozen=True)
class Edge:
    """One end of a collision region, with bounds."""

    frequency_hz: float
    time_s: float
    lower_hz: float
    upper_hz: float
    """Bounds: the nearest interval that certainly has no collisions, and the nearest with certain impacts."""


@dataclass(frozen=True)
class CollisionRegion:
    """Part of a sweep in which the masses collide."""

    DOCUMENT: ClassVar = "start stop reaches_start_of_sweep=reaches_start reaches_stop_of_sweep=reaches_stop"

    start: Edge
    """First edge of the region in time, which has the higher frequency in a downward sweep."""
    stop: Edge
    reaches_start: bool
    """Whether the sweep started inside the region, so that ``start`` is the start of the sweep."""
    reaches_stop: bool

    @property
    def low_hz(self) -> float:
        """Lowest frequency of the region [Hz]."""
        return min(self.start.frequency_hz, self.stop.frequency_hz)

    @property
    def high_hz(self) -> float:
        """Highest frequency of the region [Hz]."""
        return max(self.start.frequency_hz, self.stop.frequency_hz)


@dataclass(frozen=True)
class Collisions(Tabular):
    """All collision regions of a sweep in the order of time, with the residual and thresholds."""

    OWN_UNITS: ClassVar = {"residual_rms": "m s-1", "threshold": "m s-1", "noise_rms": "m s-1"}

    regions: tuple[CollisionRegion, ...]
    residual_rms: Reals
    """RMS of the velocity after removing all orders, shape (intervals,) [m/s]."""
    threshold: Reals
    """Largest residual of a smooth motion, shape (intervals,) [m/s]."""
    is_colliding: Flags
    """Flags of intervals inside a region, shape (intervals,)."""
    is_unexplained: Flags
    """Flags of intervals with a residual above the noise and distortion of the sensors, shape (intervals,).
    The threshold of a region, in contrast, counts rattling during a whole sweep as noise."""
    too_fast_hz: tuple[tuple[float, float], ...]
    """Frequency ranges in which collisions are not determined, because ringing may hide them."""
    noise_rms: float
    """Velocity noise from which the threshold of the residual is computed [m/s]."""


def collisions(sweep: SweptMotion) -> Collisions:
    """Find the intervals with collisions, in which the motion is not a slowly varying sine.

    Impacts cause velocity that no order of the drive explains; so does ringing after resonances in a fast
    sweep. The residual has three limits: 4 times the noise, 2 % of order 1, and twice the residual simulated
    without contact. The noise is the larger of two estimates: from the sixth difference of the samples, and
    from the quietest tenth of the sweep if it can be smooth. An interval collides if most neighbours exceed
    the limits, also in drop-outs, or if two successive intervals exceed twice the limits and show impacts.
    Above twice the limits without impacts, it is undetermined. Impacts show as orders 2 and 3 above a tenth
    of order 1 and above twice their value without contact. The residual of a region must rise. If no specimen
    is known, the region must show impacts at frequencies whose double and triple the sweep has not passed.
    """
    whole = np.flatnonzero(sweep.is_clear)
    residual = np.interp(sweep.time_s, sweep.time_s[whole], sweep.velocity.residual_rms[whole])
    fundamental = np.abs(sweep.velocity.order(1.0))
    smallest = float(np.quantile(residual, _QUIET_QUANTILE))
    can_be_smooth = _SMOOTH_AT_MOST * float(np.median(fundamental))
    noise = max(sweep.noise_rms, min(smallest, can_be_smooth / _NOISE_FACTOR))
    votes = max(1, round(_VOTE_S / sweep.interval_s))
    if votes >= residual.size:
        raise InvalidRequest(
            f"the sweep has {residual.size} intervals of {sweep.interval_s:g} s; finding collisions needs "
            f"more than {votes}"
        )
    ringing = _RINGING * np.nan_to_num(sweep.linear_residual)
    # A resonance may differ a little from its description, so take the maximum over near intervals.
    rung = maximum_filter1d(_RINGING * np.nan_to_num(sweep.linear_impacts), votes)
    impacts = sweep.velocity.impacts > np.maximum(_IMPACTS, rung)
    most = np.where(impacts, 0.0, maximum_filter1d(ringing, votes))
    smooth = np.maximum(_DISTORTION, most) * fundamental
    threshold = np.hypot(_NOISE_FACTOR * noise, smooth)
    above, is_clear = residual > threshold, sweep.is_clear & (residual > _CLEARLY * threshold)
    is_known = bool(np.isfinite(sweep.linear_residual).all())
    is_clear[0] &= is_known  # an unknown specimen may still have an initial transient
    inside = np.zeros(above.size, dtype=np.bool_)
    regions = []
    # Free ringing only decays, so a rising residual is evidence of impacts.
    is_evident = above & (residual > _RISE * np.append(residual[:1], residual[:-1]))
    usual = np.hypot(_NOISE_FACTOR * sweep.noise_rms, np.maximum(_DISTORTION, ringing) * fundamental)
    is_unlike = np.abs(np.log(sweep.response_ii / sweep.linear_ii)) > np.log(_UNLIKE)
    is_quiet = (residual < _QUIET * usual) & (ringing <= _TOO_FAST) & ~is_unlike
    is_voted = _majority(above, votes) | binary_opening(is_clear & impacts, np.ones(2, np.bool_))
    for run in _merged_runs(is_voted, round(_MERGE_S / sweep.interval_s)):
        first, last = _trim_run(above, *run, votes)
        here = slice(first, last + 1)
        is_struck = first == 0 or is_evident[here].any()
        if is_struck if is_known else np.mean(_seen_impacts(sweep)[here]) >= _ENOUGH:
            regions.append(_region(sweep, first, last, is_clear, is_evident, is_quiet))
            inside[here] = True
    is_clear |= is_known & sweep.is_clear & (residual > _ALONE * usual)
    hz, unclear = sweep.frequency_hz, (_majority(above | (ringing > _TOO_FAST), votes) | is_clear) & ~inside
    return Collisions(
        regions=tuple(regions),
        residual_rms=residual,
        threshold=threshold,
        is_colliding=inside,
        is_unexplained=residual > np.hypot(_NOISE_FACTOR * sweep.noise_rms, smooth),
        too_fast_hz=tuple((float(hz[first]), float(hz[stop - 1])) for first, stop in runs_of(unclear)),
        noise_rms=noise,
    )


def _seen_impacts(sweep: SweptMotion) -> Flags:
    """Return flags of the intervals where order 2 or 3 shows impacts of an unknown specimen.

    A mode that the drive has passed may still ring at twice or three times the drive frequency. Ringing above
    order 1 leaks into all orders.
    """
    hz, time_s = sweep.frequency_hz, sweep.time_s
    least = _IMPACTS * np.maximum(np.abs(sweep.velocity.order(1.0)), sweep.velocity.residual_rms)
    rising = np.argsort(hz)
    seen = np.zeros(hz.size, dtype=np.bool_)
    for order in (2.0, 3.0):
        passed_s = np.interp(order * hz, hz[rising], time_s[rising], right=np.inf)
        may_ring = (passed_s < time_s) & (order * hz * (time_s - passed_s) < _RING_CYCLES)
        seen |= (np.abs(sweep.velocity.order(order)) > least) & ~may_ring
    return seen


def _majority(above: Flags, votes: int) -> Flags:
    """Return whether most neighbours of each interval are flagged; one-sided at the ends of the sweep."""
    total = np.concatenate(([0], np.cumsum(above)))
    place = np.arange(above.size)
    low, high = np.maximum(place - votes // 2, 0), np.minimum(place + votes // 2 + 1, above.size)
    return np.asarray(2 * (total[high] - total[low]) > high - low)


def _merged_runs(flags: Flags, gap: int) -> list[tuple[int, int]]:
    """Return first and last index of each run of flags; runs at most ``gap`` apart are joined."""
    merged: list[tuple[int, int]] = []
    for first, stop in runs_of(flags).tolist():
        is_near = bool(merged) and first - merged[-1][1] <= gap
        merged.append((merged.pop()[0] if is_near else first, stop - 1))
    return merged


def _trim_run(above: Flags, first: int, last: int, votes: int) -> tuple[int, int]:
    """Move the ends of a run, blurred by the majority vote, to where they contradict the fewest flags."""
    half = votes // 2 + 1
    low = max(0, first - half)
    begin = low + _best_split(above[low : min(first + half, last) + 1])
    low, high = max(last - half, begin), min(last + half, above.size - 1)
    return begin, high - _best_split(above[low : high + 1][::-1])


def _best_split(part: Flags) -> int:
    """Return the first interval of a region, chosen for the fewest flags before it and gaps after it."""
    before = np.concatenate(([0], np.cumsum(part)[:-1]))
    after = np.cumsum(~part[::-1])[::-1]
    return int(np.argmin(before + after))


def _region(
    sweep: SweptMotion, first: int, last: int, is_clear: Flags, is_evident: Flags, is_quiet: Flags
) -> CollisionRegion:
    """Return a region; an edge lies between a quiet interval and the first clear or last evident impacts."""
    clear, evident = (np.flatnonzero(each[first : last + 1]) + first for each in (is_clear, is_evident))
    before, after = np.flatnonzero(is_quiet[:first]), np.flatnonzero(is_quiet[last:]) + last
    return CollisionRegion(
        start=_edge(sweep, first, [0, *before][-1], [*clear, last][0]),
        stop=_edge(sweep, last, [*after, is_quiet.size - 1][0], [first, *evident][-1]),
        reaches_start=first == 0,
        reaches_stop=last == is_quiet.size - 1,
    )


def _edge(sweep: SweptMotion, edge: int, outside: int, inside: int) -> Edge:
    """Return an edge, bounded by a quiet interval outside and an interval with impacts inside."""
    quiet_hz, clear_hz = (float(sweep.frequency_hz[at]) for at in (outside, inside))
    half_hz = 0.5 * abs(sweep.sweep_rate_hz_per_s) * sweep.interval_s
    return Edge(
        frequency_hz=float(sweep.frequency_hz[edge]),
        time_s=float(sweep.time_s[edge]),
        lower_hz=min(quiet_hz, clear_hz) - half_hz,
        upper_hz=max(quiet_hz, clear_hz) + half_hz,
    )


Sweep = SineSweep | HeldSweep
M = TypeVar("M", bound=SweptMotion)
_BLOCK = 1 << 17
_RESPONSE = 2
_LEAD_S = 5.0
_SPECTROGRAM_ORDER = 3.2
"""Upper limit of the spectrogram relative to the highest sweep frequency; contains the third harmonic."""


@dataclass(frozen=True, eq=False)
class SweepAnalysis(AbstractAnalysis[Sweep, SweepResponse]):
    """Analysis of a sweep: envelope, responses and collision regions."""

    OWN_UNITS: ClassVar = {"spectrogram": "m s-1"}
    DOCUMENT: ClassVar = (
        "*response collision_regions=collisions.regions "
        "collisions_not_determined_hz=collisions.too_fast_hz jumps"
    )

    collisions: Collisions
    jumps: tuple[Jump, ...]
    """Jumps of Response II with a smooth motion on at least one side."""
    spectrogram: Spectrogram
    """Spectrogram of the recorded velocity."""

    @property
    def rate_text(self) -> str:
        """Return a text with the sweep rate, and with the difference from steady responses if it is known."""
        text = f"at {abs(self.response.sweep_rate_hz_per_s):.3g} Hz/s"
        more = self.response.steady_over_swept - 1
        if np.isnan(more) or self.collisions.regions:
            return text
        beside = f"{100 * abs(more):.2g} % {'above' if more > 0 else 'below'} the value in this sweep"
        return f"{text}; the largest steady Response II of the described linear specimen is {beside}"


def smooth_jumps(response: SweepResponse, colliding: Collisions) -> tuple[Jump, ...]:
    """Return the jumps of Response II that have a smooth motion on at least one side.

    Without a description of the specimen, only jumps where collisions begin or end are returned: other jumps
    may be the ringing of a fast sweep.
    """
    smooth = ~colliding.is_colliding
    where = (response.time_s, response.frequency_hz, response.response_ii, smooth)
    if np.isfinite(response.linear_ii).all():
        return jumps(*where, response.linear_ii)
    edges_s = response.time_s[1:][np.diff(smooth)]
    return tuple(
        each for each in jumps(*where) if (np.abs(edges_s - each.time_s) < _NEAR * response.interval_s).any()
    )


_NEAR = 12
"""Largest distance [intervals] of a jump from the start or end of collisions to which it belongs."""


_BEHIND_STEPS = 1.5
"""Tolerated lag [steps]: up to half a step by the stepped sweep itself, and up to half by measuring."""
_CHECKED = 5
"""Number of neighbouring intervals whose median is compared with the plan."""


def played_check(response: SweepResponse, sweep: Sweep) -> Check:
    """Compare the recorded drive with the plan throughout a sweep."""
    size = min(_CHECKED, response.time_s.size)
    time_s, found_hz = (
        np.median(each[each.size % size :].reshape(-1, size), axis=1)
        for each in (response.time_s, response.frequency_hz)
    )
    half_s, cycles = 0.5 * sweep.step_s, sweep.course.cycles
    before, at, after = (cycles(time_s + each) for each in (-half_s, 0.0, half_s))
    planned_hz, rate = (after - before) / sweep.step_s, (after - 2 * at + before) / half_s**2
    behind_s = (planned_hz - found_hz) / rate
    worst = int(np.argmax(np.abs(behind_s)))
    if abs(behind_s[worst]) <= _BEHIND_STEPS * sweep.step_s + response.interval_s:
        return Check("Sweep as planned", Verdict.PASSED, "the drive followed the plan")
    text = (
        f"the drive was at {found_hz[worst]:.4g} Hz where {planned_hz[worst]:.4g} Hz were planned, "
        f"{abs(behind_s[worst]):.2g} s {'behind' if behind_s[worst] > 0 else 'ahead'}; results refer to the "
        "recorded frequencies"
    )
    return Check("Sweep as planned", Verdict.WARNING, text)


def _is_whole(channels: RecordedChannels, first: int, last: int) -> bool:
    """Return whether all samples from ``first`` to before ``last`` were recorded."""
    return first >= 0 and last <= channels.samples and not np.isnan(channels.read(first, last)).any()


def measured_sweep(
    channels: RecordedChannels, sweep: Sweep, specimen: Specimen | None = None
) -> tuple[SweepResponse, Spectrogram]:
    """Analyse the recorded part of a sweep in either direction, with a spectrogram of its velocity.

    A known ``specimen`` is simulated without contact for comparison.
    """
    stretch = only_stretch(channels, SegmentLabel.SWEEP)
    highest_hz = min(_SPECTROGRAM_ORDER * max(sweep.start_hz, sweep.stop_hz), 0.5 * channels.sample_rate_hz)
    picture = SpectrogramSums(channels.sample_rate_hz, stretch.samples, highest_hz=highest_hz)
    sums = _sums(sweep, channels, None)
    first = _read_sweep(channels, sums, picture.add)
    found = sums.response(delay_s=channels.response_delay_s, linear=_without_contact(specimen))
    return _correct(found, channels, first), picture.spectrogram()


class SweepDraws:
    """Analysis of simulated records (draws) of one recorded sweep; all have the drive of the recording."""

    def __init__(self, sweep: Sweep, specimen: Specimen | None) -> None:
        self._sweep, self._specimen = sweep, specimen
        self._clock: DrivePhase | None = None

    def motion(self, channels: RecordedChannels) -> SweptMotion:
        """Analyse a draw like `measured_sweep`; the first draw measures the phase of the drive."""
        sums = _sums(self._sweep, channels, self._clock)
        first = _read_sweep(channels, sums, lambda _: None)
        found = sums.motion(delay_s=channels.response_delay_s, linear=_without_contact(self._specimen))
        self._clock = sums.clock
        return _correct(found, channels, first)


def _sums(sweep: Sweep, channels: RecordedChannels, clock: DrivePhase | None) -> SweepSums:
    low_hz, high_hz = sorted((sweep.start_hz, sweep.stop_hz))
    return SweepSums(channels.sample_rate_hz, low_hz=low_hz, high_hz=high_hz, clock=clock)


def _without_contact(specimen: Specimen | None) -> Transmission | None:
    return None if specimen is None else lambda at_hz: base_transmissibility(specimen, at_hz)[:, 0]


def _read_sweep(channels: RecordedChannels, sums: SweepSums, show: Callable[[Reals], None]) -> float:
    """Pass the sweep and its neighbouring samples to ``sums``; return the start of the analysed part [s]."""
    stretch = only_stretch(channels, SegmentLabel.SWEEP)
    rate = channels.sample_rate_hz
    # If samples before or after the sweep are missing, use that end of the sweep instead.
    reach = min(sums.neighbour_samples, stretch.samples // 4)
    start = stretch.start + (0 if _is_whole(channels, stretch.start - reach, stretch.start) else reach)
    stop = stretch.stop - (0 if _is_whole(channels, stretch.stop, stretch.stop + reach) else reach)
    # Base motion before the sweep may still make the specimen ring, so include it in a longer lead-in.
    lead = reach * max(1, min(round(_LEAD_S * rate), start) // max(reach, 1))
    lead = lead if _is_whole(channels, start - lead, start - reach) else reach
    for begin, end, add in (
        (start - lead, start, sums.add_neighbour),
        (start, stop, sums.add),
        (stop, stop + reach, sums.add_neighbour),
    ):
        for first in range(begin, end, _BLOCK):
            block = channels.read(first, min(first + _BLOCK, end))
            if np.isnan(block).any():
                lost_s = (first - stretch.start) / rate
                raise NotEnoughData(
                    f"samples were lost after {lost_s:.3g} s of the sweep, so its phase cannot be tracked; "
                    "measure again"
                )
            add(block, channels.bridge_flags(first, min(first + _BLOCK, end)))
            show(block[_RESPONSE, max(stretch.start - first, 0) : max(stretch.stop - first, 0)])
    return (start - stretch.start) / rate


def _correct(found: M, channels: RecordedChannels, first_s: float) -> M:
    """Count times from the first sample of the sweep, and correct responses for the sensors' gains."""
    if np.mean(found.is_clear) < LEAST_CLEAR or np.isnan(found.response_i[found.is_clear]).all():
        raise UnusableData(
            f"the vibrometer lost its signal too often: {100 * np.mean(found.is_clear):.0f} % of the sweep's "
            f"intervals are without drop-outs, but {100 * LEAST_CLEAR:.0f} % are needed; refocus the laser "
            "and measure again"
        )
    sensors = channels.response_gain(found.frequency_hz)
    return replace(
        found,
        time_s=found.time_s + first_s,
        response_ii=found.response_ii / np.abs(sensors),
        sd_response_ii=found.sd_response_ii / np.abs(sensors),
        phase_rad=np.angle(np.exp(1j * found.phase_rad) / sensors),
    )


_SAME = 1e-3
"""Relative tolerance of a frequency; two clocks differ by a tenth of this tolerance."""


def frequency_check(found_hz: Reals, planned_hz: Reals) -> Check:
    """Compare each measured drive frequency with the nearest planned frequency [Hz]."""
    nearest = planned_hz[np.argmin(np.abs(found_hz[:, np.newaxis] - planned_hz), axis=1)]
    off = np.abs(found_hz / nearest - 1)
    worst = int(np.argmax(off))
    if off[worst] <= _SAME:
        return Check("Drive frequency", Verdict.PASSED, "as planned")
    text = (
        f"the drive was at {found_hz[worst]:.6g} Hz, which is not in the plan (nearest planned frequency: "
        f"{nearest[worst]:.6g} Hz). Results refer to the recorded frequencies"
    )
    return Check("Drive frequency", Verdict.WARNING, text)


_POINTS = 1000
_APART_DB = 1.5
_SMOOTHED_POINTS = 21
"""Number of points that are averaged, so that the scatter of chaos does not count as hysteresis."""
_PER_BEL_DB = 20.0


@dataclass(frozen=True, eq=False)
class Hysteresis(Tabular):
    """Difference between an up sweep and a down sweep; arrays of shape (points,)."""

    frequency_hz: Reals
    up: Reals
    down: Reals
    """Response II of the up sweep and of the down sweep."""
    differs: Flags
    """Flags of points where the sweeps, averaged over 2 % of the band, differ by more than 1.5 dB."""
    pairs: tuple[tuple[Jump, Jump], ...]
    """Pairs of opposite jumps: (jump of the up sweep, nearest jump of the down sweep)."""

    @property
    def widths_hz(self) -> tuple[tuple[float, float, float], ...]:
        """Width of each pair, with bounds: jump frequency of the up sweep minus that of the down sweep."""
        return tuple(
            (
                up.frequency_hz - down.frequency_hz,
                up.lower_hz - down.upper_hz,
                up.upper_hz - down.lower_hz,
            )
            for up, down in self.pairs
        )


def hysteresis(
    up: SweepResponse, down: SweepResponse, up_jumps: tuple[Jump, ...], down_jumps: tuple[Jump, ...]
) -> Hysteresis:
    """Compare an up sweep with a down sweep in their common range.

    Raises InvalidRequest when the directions are not up and down, or there is no common range.
    """
    if not (up.sweep_rate_hz_per_s > 0 > down.sweep_rate_hz_per_s):
        raise InvalidRequest("hysteresis needs an up sweep and a down sweep, in this order")
    low = max(float(up.frequency_hz.min()), float(down.frequency_hz.min()))
    high = min(float(up.frequency_hz.max()), float(down.frequency_hz.max()))
    if low >= high:
        raise InvalidRequest("the two sweeps have no frequency in common; compare sweeps of the same range")
    frequency_hz = np.linspace(low, high, _POINTS)
    orders = ((each, np.argsort(each.frequency_hz)) for each in (up, down))
    curves = [np.interp(frequency_hz, one.frequency_hz[to], one.response_ii[to]) for one, to in orders]
    apart_db = _PER_BEL_DB * np.log10(curves[0] / curves[1])
    together = uniform_filter1d(apart_db, _SMOOTHED_POINTS, mode="nearest")
    differs = np.asarray(np.abs(together) > _APART_DB)
    return Hysteresis(frequency_hz, curves[0], curves[1], differs, _pairs(up_jumps, down_jumps))


def _pairs(up: tuple[Jump, ...], down: tuple[Jump, ...]) -> tuple[tuple[Jump, Jump], ...]:
    """Pair jumps of opposite sign, because a step up in the up sweep is a step down in the down sweep."""
    pairs, free = [], list(down)
    for jump in up:
        opposite = [each for each in free if each.decibel * jump.decibel < 0]
        if opposite:
            nearest = min(opposite, key=lambda each: abs(each.frequency_hz - jump.frequency_hz))
            free.remove(nearest)
            pairs.append((jump, nearest))
    return tuple(pairs)
