"""Responses I and II at every step of a stepped sine, and jumps between levels."""

import math
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import sqrt
from statistics import fmean
from typing import ClassVar

import numpy as np
import scipy

from vibench.acquisition.plan import HeldResponse, ResonanceTracking, SettledSine, SteppedLevel, SteppedSine
from vibench.acquisition.recording import (
    FeedbackNote,
    Hold,
    JumpNote,
    JumpSearchEnd,
    NoiseNote,
    ResonanceNote,
    SegmentLabel,
    SegmentNote,
    Steadiness,
)

from ..errors import NotEnoughData
from ..recordings.channels import RecordedChannels, Stretch
from ..recordings.checks import AbstractAnalysis, Check, Verdict
from ..signals import Integers, Reals, steady_line
from ..tables import Tabular, columns, plus_minus
from ..tones import fit_sine
from .dwell import LEAST_CLEAR, DwellResponse, clear_of_dropouts, dwell_response, silence_before

Steps = SteppedSine | SteppedLevel | SettledSine | ResonanceTracking | HeldResponse
"""Plans whose recordings have steps of frequency or level."""
_EDGE_PERIODS = 60.0
"""Drive periods that integration disturbs at each end."""
_OF_A_STEP = (
    "frequency_hz=drive.frequency_hz drive_amplitude_m=drive.amplitude_m "
    "sd_drive_amplitude_m=drive.sd_amplitude_m response_i noise_bias_i noise_error_i response_ii "
    "sd_response_ii slow_change phase_rad"
)


@dataclass(frozen=True)
class SteppedResponse(Tabular):
    """Results of a stepped sine, one value per step in the order of playing; arrays of shape (steps,)."""

    DOCUMENT: ClassVar = (
        "frequency_hz direction drive_amplitude_m response_i noise_bias_i noise_error_i response_ii "
        "sd_response_ii slow_change left_out"
    )

    frequency_hz: Reals
    """Measured frequency of the drive."""
    direction: tuple[str, ...]
    """Direction of each step, ``"up"`` or ``"down"``."""
    amplitude_vpp: Reals
    """Generator voltage, peak to peak [V]; NaN if feedback set the voltage."""
    drive_amplitude_m: Reals
    sd_drive_amplitude_m: Reals
    response_i: Reals
    noise_bias_i: Reals
    noise_error_i: Reals
    """Bias and rms error of Response I due to noise; NaN if the noise is unknown."""
    response_ii: Reals
    sd_response_ii: Reals
    """Standard deviation of Response II; NaN if the response still changed during the step."""
    slow_change: Reals
    """Relative standard uncertainty of Response I due to slow change; NaN if unknown."""
    phase_rad: Reals
    left_out: int
    """Number of steps that were incomplete, or had lost samples or drop-outs."""


def stepped_response(
    channels: RecordedChannels,
    plan: Steps,
    label: SegmentLabel,
    setting_vpp: Callable[[Steps, Stretch], float],
) -> SteppedResponse:
    """Analyse every complete step as a dwell.

    Raises NotEnoughData when no step is complete.

    Parameters
    ----------
    label
        Label of the segments of the steps.
    setting_vpp
        Function that returns the generator voltage of a step, peak to peak [V].
    """
    stretches = channels.stretches(label)
    whole = [each for each in stretches if each.is_complete]
    pairs = [(each, found) for each in whole if (found := _step(channels, each, plan)) is not None]
    if not pairs:
        raise NotEnoughData(
            f"none of the steps of {plan.record_s:g} s is complete, so there is no result; measure again"
        )
    steps = [columns(found, _OF_A_STEP) for _, found in pairs]
    return SteppedResponse(
        **{key: np.array([each[key] for each in steps]) for key in steps[0]},
        direction=tuple(str(stretch.numbers.get("direction", "up")) for stretch, _ in pairs),
        amplitude_vpp=np.array([setting_vpp(plan, stretch) for stretch, _ in pairs]),
        left_out=len(stretches) - len(steps),
    )


def _step(channels: RecordedChannels, stretch: Stretch, plan: Steps) -> DwellResponse | None:
    data = channels.read(stretch.start, stretch.stop)
    if np.isnan(data).any():
        return None
    near_hz = float(stretch.numbers["frequency_hz"])
    rate = channels.sample_rate_hz
    edge = int(np.ceil(_EDGE_PERIODS / near_hz * rate)) + 1
    line = steady_line(data[-1], fit_sine(data[0], rate, near_hz).frequency_hz / rate, edge).samples()
    inside = line[edge:-edge]
    # Remove sensor drift: where the record is continued, drift means a jump, which integration amplifies.
    data[-1] = scipy.signal.detrend(data[-1] - inside) + inside
    # Samples outside the step have another frequency or level, and would affect the integration. Replace
    # these samples: continue the sine exactly, and the remaining signal by copies.
    places = _continuation_samples(data, rate / near_hz, edge)
    drive, base, response = data[:, places]
    response += line - inside[places]
    bridged = channels.bridge_flags(stretch.start, stretch.stop)[places]
    if np.mean(clear_of_dropouts(bridged, rate, near_hz)[edge:-edge]) < LEAST_CLEAR:
        return None
    return dwell_response(
        drive,
        base,
        response,
        rate,
        near_hz=near_hz,
        window_s=min(plan.record_s, data.shape[1] / rate),
        delay_s=channels.response_delay_s,
        sensors=complex(channels.response_gain(np.array([near_hz]))[0]),
        silence=silence_before(channels)[-1],
        bridged=bridged,
    )


def _continuation_samples(data: Reals, period_samples: float, edge: int) -> Integers:
    """Return the indices that continue a record at both ends, shape (samples + 2 edge,).

    Copies of both ends continue the record; the copies' length in drive periods is chosen for the best fit.
    """
    before = _repeats_after(data[-1], period_samples)
    after = _repeats_after(data[-1, ::-1], period_samples)
    inside, outside = data.shape[1], np.arange(edge)
    return np.concatenate(
        [(before - 1 - outside % before)[::-1], np.arange(inside), inside - after + outside % after]
    )


def _repeats_after(motion: Reals, period_samples: float) -> int:
    """Return the number of samples after which the first period of a motion repeats best."""
    period = round(period_samples)
    shifts = np.rint(np.arange(1.0, motion.size / period_samples - 1.0) * period_samples).astype(int)
    apart = [np.sum((motion[shift : shift + period] - motion[:period]) ** 2) for shift in shifts]
    return int(shifts[np.argmin(apart)]) if apart else motion.size


def settled_check(what: str, frequency_hz: Reals, slow_change: Reals) -> Check:
    """Warn of steps or of a dwell if the base level or the response still changed during the record."""
    changing_hz = frequency_hz[np.isnan(slow_change)]
    if not changing_hz.size:
        return Check(what, Verdict.PASSED, "neither base level nor response drifted")
    text = (
        f"base level or response still changed during {changing_hz.size} of {frequency_hz.size} records, "
        f"first at {changing_hz[0]:.6g} Hz, so these responses have no bounds; increase the settling time"
    )
    return Check(what, Verdict.WARNING, text)


@dataclass(frozen=True, eq=False)
class SteppedSineAnalysis(AbstractAnalysis[Steps, SteppedResponse]):
    """Analysis of a stepped sine: responses at every frequency, or at every level."""

    DOCUMENT: ClassVar = "*response"


# Backbone: the resonance of a mode at every tracked level.
#
# Sentences on the findings of feedback: jumps, irregular motions, resonances, missed levels.


def noted_jumps(notes: Sequence[FeedbackNote]) -> tuple[tuple[float, float, str], ...]:
    """Return both bounds [Hz] and the direction of each jump that was located as precisely as requested."""
    return tuple(
        (min(each.before_hz, each.after_hz), max(each.before_hz, each.after_hz), each.direction)
        for each in notes
        if isinstance(each, JumpNote) and each.how is JumpSearchEnd.LOCALISED
    )


def feedback_sentences(notes: Sequence[FeedbackNote]) -> Iterator[str]:
    """Yield sentences on the findings of feedback; none without feedback."""
    jumps = noted_jumps(notes)
    if jumps:
        text = ", ".join(f"{low_hz:.5g} and {high_hz:.5g} Hz ({way})" for low_hz, high_hz, way in jumps)
        yield f"Jumps between {text}."
    yield from _motions([each for each in notes if isinstance(each, SegmentNote)])
    yield from (_resonance(each) for each in notes if isinstance(each, ResonanceNote))
    yield from _spectrum([each for each in notes if isinstance(each, NoiseNote) and each.realisation >= 0])


def _motions(steps: Sequence[SegmentNote]) -> Iterator[str]:
    """Yield sentences on the kinds of recorded motions (except period one) and on levels not reached."""
    count = Counter((each.motion, each.period) for each in steps)
    kinds = [
        f"period {period}: {count[Steadiness.PERIODIC, period]}"
        for period in sorted(period for motion, period in count if motion is Steadiness.PERIODIC)
        if period > 1
    ]
    motions = Counter(each.motion for each in steps)
    for motion, word in ((Steadiness.APERIODIC, "no period"), (Steadiness.UNSETTLED, "not settled")):
        kinds += [f"{word}: {motions[motion]}"] * bool(motions[motion])
    if kinds:
        yield f"{len(steps)} recorded motions, by kind: {', '.join(kinds)}."
    outside = sum(each.level is Hold.OUTSIDE for each in steps)
    if outside:
        yield f"The base level was out of tolerance in {outside} of {len(steps)} recorded motions."


def _spectrum(kept: Sequence[NoiseNote]) -> Iterator[str]:
    """Yield sentences on the error of the base spectrum."""
    if not kept:
        return
    worst = max(kept, key=lambda each: abs(each.worst_db))
    rms = sqrt(fmean(each.base_rms**2 for each in kept))
    requested = sqrt(fmean(each.asked_rms**2 for each in kept))
    yield (
        f"Base acceleration: {rms:.3g} m/s² rms ({requested:.3g} requested); "
        f"{fmean(each.within for each in kept):.1%} of the lines were within the tolerance; worst line: "
        f"{worst.worst_db:+.1f} dB at {worst.worst_hz:g} Hz; kurtosis "
        f"{fmean(each.kurtosis for each in kept):.2f}."
    )
    if (notched := fmean(each.notched for each in kept)) > 0:
        yield f"{notched:.1%} of the lines were lowered to limit the response."


def _resonance(note: ResonanceNote) -> str:
    level = f"{note.asked_m_per_s2:g} m/s²"
    of = "phase resonance"
    if note.harmonic > 1:
        of = f"superharmonic {note.harmonic}:1 {of}"
    if note.subharmonic > 1:
        of = f"subharmonic 1:{note.subharmonic} {of}"
    if note.frequency_hz is None or note.frequency_u_hz is None:
        after = f"after {note.periods} periods " if note.periods else ""
        return (
            f"No {of} at {level}: {note.lock.value}; {after}the phase was {note.phase_deg:.1f}° at "
            f"{note.at_hz:.5g} Hz, the level was {note.held.value}, and the motion was {note.motion.value}."
        )
    took = f", {note.periods} periods" if note.periods else ""
    hertz = plus_minus(note.frequency_hz, 2 * note.frequency_u_hz)
    text = f"{of[0].upper()}{of[1:]} at {hertz} Hz ({level}{took})"
    if note.mode_hz is None or note.mode_u_hz is None:
        return f"{text}."
    return (
        f"{text}; natural frequency {plus_minus(note.mode_hz, 2 * note.mode_u_hz)} Hz, "
        f"damping ratio {note.damping_ratio:.3g}."
    )


@dataclass(frozen=True)
class TrackedResonance:
    """Resonance of a mode at one level of the base."""

    number: int
    """Index of the base level in the order of playing, from 0."""
    base_m_per_s2: float
    """Peak of the fundamental of the base acceleration."""
    frequency_hz: float
    """Frequency at which m0 lags the base by the requested phase."""
    u_frequency_hz: float
    """Standard uncertainty of the frequency, including the sensors' phase, which is common to all levels."""
    amplitude_m: float
    """Amplitude of m0 at the drive frequency, or at the resonant harmonic or subharmonic."""
    harmonic: int
    """Harmonic of the drive at which m0 resonates."""
    subharmonic: int
    """Number of drive periods in one period of m0's motion."""
    mode_hz: float | None
    """Natural frequency, fitted to both flanks of the resonance; None if undetermined."""
    u_mode_hz: float | None
    damping_ratio: float | None

    @property
    def is_fundamental(self) -> bool:
        """Whether m0 resonates at the frequency of the drive."""
        return self.harmonic == self.subharmonic == 1


def tracked_resonances(notes: Sequence[FeedbackNote]) -> tuple[TrackedResonance, ...]:
    """Return the resonances that were found, sorted by base level from the weakest."""
    keys = (
        "number=level base_m_per_s2 frequency_hz u_frequency_hz=frequency_u_hz harmonic subharmonic mode_hz "
        "u_mode_hz=mode_u_hz damping_ratio"
    )
    found = []
    for each in notes:
        if isinstance(each, ResonanceNote) and None not in {each.frequency_hz, each.frequency_u_hz}:
            fundamental_m = each.response_ii * each.base_m_per_s2 / (2 * math.pi * each.at_hz) ** 2
            amplitude_m = each.harmonic_m or fundamental_m
            found.append(TrackedResonance(**columns(each, keys), amplitude_m=amplitude_m))
    return tuple(sorted(found, key=lambda each: each.base_m_per_s2))


def lost_levels(notes: Sequence[FeedbackNote]) -> tuple[float, ...]:
    """Return the requested levels [m/s²] at which no resonance was found."""
    lost = (each for each in notes if isinstance(each, ResonanceNote) and each.frequency_hz is None)
    return tuple(sorted(each.asked_m_per_s2 for each in lost))


def backbone_sentence(levels: Sequence[TrackedResonance]) -> str:
    """Return a sentence on the resonance's softening or hardening from the weakest to the strongest level."""
    if len(levels) < 2:
        return ""
    first, last = levels[0], levels[-1]
    shift_hz = last.frequency_hz - first.frequency_hz
    u_hz = 2 * math.hypot(first.u_frequency_hz, last.u_frequency_hz)
    moved = f"by {'+' if shift_hz > 0 else ''}{plus_minus(shift_hz, u_hz)} Hz"
    what = "the phase resonance" if first.is_fundamental else "the drive at phase resonance"
    between = f"From {first.base_m_per_s2:.3g} to {last.base_m_per_s2:.3g} m/s² {what} moves"
    if abs(shift_hz) <= u_hz:
        return f"{between} {moved}: neither softening nor hardening is significant."
    return f"{between} {moved}: the mode {'hardens' if shift_hz > 0 else 'softens'}."


JUMP_FACTOR = 2.0
"""Minimum ratio of Response II at two levels that counts as a jump; for a linear specimen the ratio is 1."""

_UNSTEADY = 0.05
"""Relative uncertainty of Response II above which a step may contain two motions; NaN counts as above."""


@dataclass(frozen=True)
class LevelJump:
    """Jump of Response II between two consecutive levels."""

    direction: str
    """``"up"`` or ``"down"``: direction in which the level is stepped."""
    before_vpp: float
    after_vpp: float
    factor: float
    """Response II after the jump divided by Response II before the jump."""


def level_jumps(response: SteppedResponse) -> tuple[LevelJump, ...]:
    """Return the jumps of a stepped level in the order of time, except across a turning point.

    If the motion jumps during a step, its response is a mean of two motions. Such a step is skipped, and the
    steps before and after it are compared.
    """
    levels, sizes = response.amplitude_vpp.tolist(), response.response_ii.tolist()
    steps = list(zip(response.direction, levels, sizes, strict=True))
    steady = response.sd_response_ii < _UNSTEADY * response.response_ii
    for place in range(len(steps) - 2, 0, -1):
        (way, *_, before), (_, *_, now), (other, *_, after) = steps[place - 1 : place + 2]
        if not steady[place] and way == other and min(before, after) < now < max(before, after):
            del steps[place]
    found = []
    for (way, before_vpp, before), (other, after_vpp, after) in pairwise(steps):
        if way == other and before > 0 and not 1 / JUMP_FACTOR <= after / before <= JUMP_FACTOR:
            found.append(LevelJump(way, before_vpp, after_vpp, after / before))
    return tuple(found)


def hysteresis_vpp(jumps: tuple[LevelJump, ...]) -> tuple[float, float] | None:
    """Return the bounds of the difference: level of the jump up minus level of the jump down [V].

    Returns None unless there are jumps in both directions.
    """
    rises = [each for each in jumps if each.direction == "up" and each.factor > 1]
    falls = [each for each in jumps if each.direction == "down" and each.factor < 1]
    if not rises or not falls:
        return None
    rise, fall = rises[0], falls[-1]
    return rise.before_vpp - fall.before_vpp, rise.after_vpp - fall.after_vpp


@dataclass(frozen=True, eq=False)
class SteppedLevelAnalysis(SteppedSineAnalysis):
    """Results of a stepped level, with the jumps of its response."""

    DOCUMENT: ClassVar = (
        f"{SteppedSineAnalysis.DOCUMENT} amplitude_vpp=response.amplitude_vpp jumps hysteresis_vpp"
    )

    @property
    def jumps(self) -> tuple[LevelJump, ...]:
        """Jumps in the order of time."""
        return level_jumps(self.response)

    @property
    def hysteresis_vpp(self) -> tuple[float, float] | None:
        """Bounds of the difference: level of the jump up minus level of the jump down [V]."""
        return hysteresis_vpp(self.jumps)
