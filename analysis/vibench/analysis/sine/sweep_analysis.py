"""Analysis of a recorded sweep: its responses, and a spectrogram of its velocity."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import ClassVar, TypeVar

import numpy as np

from vibench.acquisition.plan import HeldSweep, SineSweep
from vibench.acquisition.recording import SegmentLabel
from vibench.sim import Specimen, base_transmissibility

from ..errors import NotEnoughData, UnusableData
from ..recordings.channels import Channels, only_stretch
from ..recordings.checks import AbstractAnalysis, Check, Verdict
from ..signals.arrays import Reals
from ..spectra.spectra import Spectrogram, SpectrogramSums
from .collision_region import Collisions
from .dwell import LEAST_CLEAR
from .jumps import Jump, jumps
from .sweep import DrivePhase, SweepResponse, SweepSums, SweptMotion, Transmission

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
        """Return the sweep rate, and the difference from steady responses if known."""
        text = f"at {abs(self.response.sweep_rate_hz_per_s):.3g} Hz/s"
        more = self.response.steady_over_swept - 1
        if np.isnan(more) or self.collisions.regions:
            return text
        beside = f"{100 * abs(more):.2g} % {'above' if more > 0 else 'below'} that in this sweep"
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
"""Tolerated lag [steps]; a stepped sweep lags by up to half a step, and measuring adds up to another half."""
_LAST = 5
"""Number of intervals that are checked at the end of a sweep."""


def played_check(response: SweepResponse, sweep: Sweep) -> Check:
    """Compare the recorded drive at the end of a sweep with the plan."""
    last = slice(-_LAST, None)
    found_hz, time_s = float(np.median(response.frequency_hz[last])), float(np.median(response.time_s[last]))
    half_s = 0.5 * sweep.step_s
    planned_hz = (sweep.cycles(time_s + half_s) - sweep.cycles(time_s - half_s)) / sweep.step_s
    behind_s = (planned_hz - found_hz) / response.sweep_rate_hz_per_s
    if abs(behind_s) <= _BEHIND_STEPS * sweep.step_s + response.interval_s:
        return Check("Sweep as planned", Verdict.PASSED, "the drive followed the plan")
    text = (
        f"the drive was at {found_hz:.4g} Hz where {planned_hz:.4g} Hz were planned, {abs(behind_s):.2g} s "
        f"{'behind' if behind_s > 0 else 'ahead'}; results refer to the recorded frequencies"
    )
    return Check("Sweep as planned", Verdict.WARNING, text)


def _is_whole(channels: Channels, first: int, last: int) -> bool:
    """Return whether all samples from ``first`` to before ``last`` were recorded."""
    return first >= 0 and last <= channels.samples and not np.isnan(channels.read(first, last)).any()


def measured_sweep(
    channels: Channels, sweep: Sweep, specimen: Specimen | None = None
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

    def motion(self, channels: Channels) -> SweptMotion:
        """Analyse a draw like `measured_sweep`; the first draw measures the phase of the drive."""
        sums = _sums(self._sweep, channels, self._clock)
        first = _read_sweep(channels, sums, lambda _: None)
        found = sums.motion(delay_s=channels.response_delay_s, linear=_without_contact(self._specimen))
        self._clock = sums.clock
        return _correct(found, channels, first)


def _sums(sweep: Sweep, channels: Channels, clock: DrivePhase | None) -> SweepSums:
    low_hz, high_hz = sorted((sweep.start_hz, sweep.stop_hz))
    return SweepSums(channels.sample_rate_hz, low_hz=low_hz, high_hz=high_hz, clock=clock)


def _without_contact(specimen: Specimen | None) -> Transmission | None:
    return None if specimen is None else lambda at_hz: base_transmissibility(specimen, at_hz)[:, 0]


def _read_sweep(channels: Channels, sums: SweepSums, show: Callable[[Reals], None]) -> float:
    """Pass the sweep and its neighbouring samples to ``sums``; return the start of the analysed part [s]."""
    stretch = only_stretch(channels, SegmentLabel.SWEEP)
    rate = channels.sample_rate_hz
    # If samples before or after the sweep are missing, an end of the sweep replaces them.
    reach = min(sums.neighbour_samples, stretch.samples // 4)
    start = stretch.start + (0 if _is_whole(channels, stretch.start - reach, stretch.start) else reach)
    stop = stretch.stop - (0 if _is_whole(channels, stretch.stop, stretch.stop + reach) else reach)
    # A longer lead-in contains base motion before the sweep, from which the specimen may still ring.
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


def _correct(found: M, channels: Channels, first_s: float) -> M:
    """Count times from the first sample of the sweep, and correct responses for the sensors' gains."""
    if np.mean(found.is_clear) < LEAST_CLEAR or np.isnan(found.response_i[found.is_clear]).all():
        raise UnusableData(
            f"the vibrometer lost its light too often: {100 * np.mean(found.is_clear):.0f} % of the sweep's "
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
