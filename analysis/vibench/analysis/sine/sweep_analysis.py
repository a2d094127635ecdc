"""Analysis of a recorded sweep: its responses, its collision regions, and a spectrogram of its velocity."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import ClassVar, TypeVar

import numpy as np
from scipy.ndimage import binary_opening, maximum_filter1d

from vibench.acquisition.plan import HeldSweep, SineSweep
from vibench.acquisition.recording import SegmentLabel
from vibench.sim import Specimen, base_transmissibility

from ..errors import InvalidRequest, NotEnoughData, UnusableData
from ..recordings.channels import RecordedChannels, only_stretch
from ..recordings.checks import AbstractAnalysis, Check, Verdict
from ..signals import Flags, Reals, runs_of
from ..spectra import Spectrogram, SpectrogramSums
from ..tables import Tabular
from .dwell import LEAST_CLEAR
from .jumps import Jump, jumps
from .sweep import DrivePhase, SweepResponse, SweepSums, SweptMotion, Transmission

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
