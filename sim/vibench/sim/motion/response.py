"""Responses I and II of a specimen under a harmonic drive, observed during the integration. SI units."""

import math
from dataclasses import dataclass

from numpy.typing import ArrayLike

from ..engine.run import (
    MAX_IMPACT_RATE_HZ,
    Accuracy,
    AccuracyWord,
    NativeRun,
    Outcome,
    RunRecord,
    Watch,
    most_impacts,
    start_motion,
)
from ..specimen.drive import WHOLE, Harmonic
from ..specimen.specimen import Floats, Specimen
from ..specimen.stops import member, require_positive
from .integrate import check_impact_rate


@dataclass(frozen=True, eq=False)
class Response:
    """Responses of a motion at one drive; NaN if the run did not reach its end."""

    drive: Harmonic
    accuracy: Accuracy
    duration_s: float
    window_s: float
    """Length of the window at the end of the run, in which the largest abs(x) and abs(p) are observed [s]."""
    line_periods: int
    """Number of whole drive periods, at the end of the window, from which the phasors are computed."""
    largest_x_m: float
    """Largest abs(x) in the window [m]."""
    largest_p_m: float
    """Largest abs(p), p = y - z, in the window [m]."""
    line_x_m: complex
    """Drive-frequency phasor [m]: x = Re(line_x_m exp(i (omega t + phase))); the phasor of U is -i A0."""
    line_p_m: complex
    """Phasor of p at the drive frequency [m]."""
    impacts: int
    """Number of contacts that began in the evaluated window."""
    impacts_before: int
    """Number of contacts that began before the evaluated window."""
    line_start_state: Floats
    """x, y, z, vx, vy, vz at the start of the drive periods counted by ``line_periods``, shape (6,)."""
    final_state: Floats
    """x, y, z, vx, vy, vz at the end of the run; the next point of a sweep may start here, shape (6,)."""
    outcome: Outcome

    @property
    def response_i(self) -> float:
        """Largest abs(x) in the window, divided by the drive amplitude."""
        return self.largest_x_m / self.drive.amplitude_m

    @property
    def response_ii(self) -> float:
        """Amplitude of x at the drive frequency, divided by the drive amplitude."""
        return abs(self.line_x_m) / self.drive.amplitude_m

    @property
    def relative_i(self) -> float:
        """Largest abs(p) in the window, divided by the drive amplitude."""
        return self.largest_p_m / self.drive.amplitude_m

    @property
    def relative_ii(self) -> float:
        """Amplitude of p at the drive frequency, divided by the drive amplitude."""
        return abs(self.line_p_m) / self.drive.amplitude_m


def steady_response(
    specimen: Specimen,
    drive: Harmonic,
    accuracy: Accuracy | AccuracyWord = Accuracy.STANDARD,
    duration_s: float = 30.0,
    window_s: float = 5.0,
    initial_state: ArrayLike | None = None,
    *,
    max_impact_rate_hz: float = MAX_IMPACT_RATE_HZ,
) -> Response:
    """Integrate a motion and return its responses in the window at the end of the run.

    The defaults are those of Gong et al. 2025, section 2: 30 s from rest, of which the last 5 s are
    evaluated. In a chaotic motion, Response I scatters by a few per cent at every accuracy level. The final
    motion may depend on ``initial_state``, shape (6,) [m, m/s]; state this start with the result.

    Raises ValueError when the drive amplitude is zero, or the window is longer than the run or shorter than
    one drive period.
    """
    accuracy = member(Accuracy, accuracy)
    periods = whole_periods(drive, duration_s, window_s)
    check_impact_rate(max_impact_rate_hz)
    run = NativeRun(specimen, drive, start_motion(initial_state), accuracy.tolerance)
    record = RunRecord(most_impacts(max_impact_rate_hz, duration_s))
    line_s = periods / drive.frequency_hz
    outcome = run.advance(float(duration_s - window_s), record)
    before, line_start = record.impacts, run.motion
    for watch, until in ((Watch.PEAKS, duration_s - line_s), (Watch.PEAKS_AND_LINES, float(duration_s))):
        if outcome is Outcome.REACHED_END:
            line_start = run.motion
            record.watch(watch)
            outcome = run.advance(until, record)
    # A phasor is twice the time average of the motion times exp(-i (omega t + phase)).
    scale = 2.0 / line_s if outcome is Outcome.REACHED_END else math.nan
    peaks = (record.peak_x_m, record.peak_p_m) if outcome is Outcome.REACHED_END else (math.nan, math.nan)
    return Response(
        drive=drive,
        accuracy=accuracy,
        duration_s=duration_s,
        window_s=window_s,
        line_periods=periods,
        largest_x_m=peaks[0],
        largest_p_m=peaks[1],
        line_x_m=scale * record.area_x,
        line_p_m=scale * record.area_p,
        impacts=record.impacts - before,
        impacts_before=before,
        line_start_state=line_start,
        final_state=run.motion,
        outcome=outcome,
    )


def whole_periods(drive: Harmonic, duration_s: float, window_s: float) -> int:
    """Return the number of whole drive periods in a window; raise ValueError for an unusable window."""
    if drive.amplitude_m == 0.0:
        raise ValueError(
            "A response over a drive amplitude of 0 m is not defined: give a positive amplitude."
        )
    require_positive("Duration", duration_s, "s")
    if not 0.0 < window_s <= duration_s:
        raise ValueError(
            f"Window {window_s} s is not allowed: it must be positive and within the run of {duration_s} s."
        )
    periods = math.floor(window_s * drive.frequency_hz * (1.0 + WHOLE))
    if periods < 1:
        raise ValueError(
            f"Window {window_s} s is not allowed at {drive.frequency_hz} Hz: "
            f"it must contain one drive period, {1.0 / drive.frequency_hz} s."
        )
    return periods
