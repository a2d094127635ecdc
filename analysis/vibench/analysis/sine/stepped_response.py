"""Responses I and II at every frequency of a stepped sine."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from vibench.acquisition.plan import (
    HeldResponse,
    ResonanceTracking,
    SettledSine,
    SteppedLevel,
    SteppedSine,
)
from vibench.acquisition.recording import SegmentLabel

from ..errors import NotEnoughData
from ..recordings.channels import Channels, Stretch
from ..recordings.checks import AbstractAnalysis, Check, Verdict
from ..signals.arrays import Integers, Reals
from ..tables import Labelled, columns
from .dwell import LEAST_CLEAR, DwellResponse, clear_of_dropouts, dwell_response, silence_before

Steps = SteppedSine | SteppedLevel | SettledSine | ResonanceTracking | HeldResponse
"""What is recorded frequency by frequency, or level by level."""
_EDGE_PERIODS = 60.0
"""Drive periods that integration disturbs at each end."""
_OF_A_STEP = (
    "frequency_hz=drive.frequency_hz drive_amplitude_m=drive.amplitude_m "
    "sd_drive_amplitude_m=drive.sd_amplitude_m response_i noise_bias_i noise_error_i response_ii "
    "sd_response_ii slow_change phase_rad"
)


@dataclass(frozen=True)
class SteppedResponse(Labelled):
    """One value for each step, in the order played; arrays of shape (steps,)."""

    DOCUMENT: ClassVar = (
        "frequency_hz direction drive_amplitude_m response_i noise_bias_i noise_error_i response_ii "
        "sd_response_ii slow_change left_out"
    )

    frequency_hz: Reals
    """As measured on the drive."""
    direction: tuple[str, ...]
    """``"up"`` or ``"down"``."""
    amplitude_vpp: Reals
    """Setting of the generator [V]; NaN where it was not a plan's but feedback's."""
    drive_amplitude_m: Reals
    sd_drive_amplitude_m: Reals
    response_i: Reals
    noise_bias_i: Reals
    noise_error_i: Reals
    """Root mean square error that noise makes of Response I; NaN, as its lift is, where not determined."""
    response_ii: Reals
    sd_response_ii: Reals
    """NaN where the response still changed during the step."""
    slow_change: Reals
    """Relative standard uncertainty that slow change adds to Response I; NaN likewise."""
    phase_rad: Reals
    left_out: int
    """Steps that were cut short, or lost samples or light."""


def stepped_response(
    channels: Channels, plan: Steps, label: SegmentLabel, setting_vpp: Callable[[Steps, Stretch], float]
) -> SteppedResponse:
    """Analyse every whole step as a dwell of its own.

    Raises NotEnoughData when no step was recorded whole.

    Parameters
    ----------
    label
        Of the segments that the steps were recorded as.
    setting_vpp
        Tells the generator's setting during a step [V].

    """
    stretches = channels.stretches(label)
    whole = [each for each in stretches if each.is_complete]
    pairs = [(each, found) for each in whole if (found := _step(channels, each, plan)) is not None]
    if not pairs:
        raise NotEnoughData(
            f"none of the steps of {plan.record_s:g} s was recorded whole, so there is no response to show; "
            "measure again"
        )
    steps = [columns(found, _OF_A_STEP) for _, found in pairs]
    return SteppedResponse(
        **{key: np.array([each[key] for each in steps]) for key in steps[0]},
        direction=tuple(str(stretch.numbers.get("direction", "up")) for stretch, _ in pairs),
        amplitude_vpp=np.array([setting_vpp(plan, stretch) for stretch, _ in pairs]),
        left_out=len(stretches) - len(steps),
    )


def _step(channels: Channels, stretch: Stretch, plan: Steps) -> DwellResponse | None:
    data = channels.read(stretch.start, stretch.stop)
    if np.isnan(data).any():
        return None
    near_hz = float(stretch.numbers["frequency_hz"])
    rate = channels.sample_rate_hz
    edge = int(np.ceil(_EDGE_PERIODS / near_hz * rate)) + 1
    # What came before and after was at another frequency or level, and integration would bring it in.
    places = _continued(data, rate / near_hz, edge)
    drive, base, response = data[:, places]
    bridged = channels.bridged(stretch.start, stretch.stop)[places]
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
        silence=silence_before(channels),
        bridged=bridged,
    )


def _continued(data: Reals, period_samples: float, edge: int) -> Integers:
    """Return the samples with which to go on at both ends, shape (samples + 2 edge,).

    The last row, the response, tells how far: whole drive periods, those after which it repeats best.
    """
    before = _repeats_after(data[-1], period_samples)
    after = _repeats_after(data[-1, ::-1], period_samples)
    inside, outside = data.shape[1], np.arange(edge)
    return np.concatenate(
        [(before - 1 - outside % before)[::-1], np.arange(inside), inside - after + outside % after]
    )


def _repeats_after(motion: Reals, period_samples: float) -> int:
    """Find after how many samples the first period of a motion comes again most nearly."""
    period = round(period_samples)
    shifts = np.rint(np.arange(1.0, motion.size / period_samples - 1.0) * period_samples).astype(int)
    apart = [np.sum((motion[shift : shift + period] - motion[:period]) ** 2) for shift in shifts]
    return int(shifts[np.argmin(apart)]) if apart else motion.size


def settled_check(response: SteppedResponse) -> Check:
    """Warn of steps whose response still changed while they were recorded."""
    changing_hz = response.frequency_hz[np.isnan(response.slow_change)]
    if not changing_hz.size:
        return Check("Steps settled", Verdict.PASSED, "no response changed steadily during its step")
    text = (
        f"{changing_hz.size} of {response.frequency_hz.size} responses still changed during their steps, "
        f"first at {changing_hz[0]:.6g} Hz, and their bounds are not stated; increase the settling time"
    )
    return Check("Steps settled", Verdict.WARNING, text)


@dataclass(frozen=True, eq=False)
class SteppedSineAnalysis(AbstractAnalysis[Steps, SteppedResponse]):
    """A stepped sine: responses at every frequency, or at every level."""

    DOCUMENT: ClassVar = "*response"
