"""Integration of a specimen's motion under a drive. SI units."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..engine.run import (
    MAX_IMPACT_RATE_HZ,
    Accuracy,
    AccuracyWord,
    CubicRun,
    NativeRun,
    Outcome,
    RunRecord,
    most_impacts,
    start_motion,
)
from ..specimen.drive import Drive, Harmonic, Sampled, Sweep
from ..specimen.specimen import Floats, Specimen
from ..specimen.stops import member

# Drives: the base displacement as cubic polynomials in time, on equal time intervals. SI units.
#
# A sampled drive is defined as the C2 spline through its samples. For a sweep, the cubic matches the sweep's
# displacement and velocity at both ends of each interval (C1). The displacement error is then at most
# amplitude (omega h)^4 / 384 at the highest frequency. The interval h is chosen so that this error is at most
# a thousandth of the tolerance.

HERMITE = 384.0
"""Denominator in the error of cubic Hermite interpolation: h^4 / 384 times the fourth derivative."""
SHARE = 1e-3
"""Largest error of the interpolation of a sweep, relative to the tolerance."""
SHORTEST_TURN = 0.005
"""Shortest interval [rad at the highest frequency], with an interpolation error of 2e-12 of the amplitude."""


class BaseMotion(NamedTuple):
    """Base displacement as cubic polynomials on equal intervals."""

    interval: float
    """Length of a time interval of the drive [s]."""
    pieces: NDArray[np.float64]
    """Coefficients c0 to c3 of U(tau) = c0 + c1 tau + c2 tau^2 + c3 tau^3, shape (intervals, 4)."""


def sampled_motion(drive: Sampled) -> BaseMotion:
    """Return the base motion of a sampled drive, with one cubic between successive samples."""
    interval = 1.0 / drive.sample_rate_hz
    # With the interval as the unit of time, the spline's knots are integers, which are exact.
    from scipy.interpolate import CubicSpline  # noqa: PLC0415 - harmonic drives do without scipy

    spline = CubicSpline(np.arange(len(drive.displacement_m), dtype=np.float64), drive.displacement_m)
    return BaseMotion(interval, np.ascontiguousarray(spline.c[::-1].T / interval ** np.arange(4)))


def sweep_interval_s(drive: Sweep, accuracy: Accuracy) -> float:
    """Return the longest interval whose interpolation error is `SHARE` times the tolerance [s]."""
    turn = max(SHORTEST_TURN, (HERMITE * SHARE * accuracy.tolerance) ** 0.25)
    intervals = math.ceil(drive.duration_s * 2.0 * math.pi * drive.highest_hz / turn)
    interval: float = drive.duration_s / intervals
    return interval


def sweep_motion(drive: Sweep, interval_s: float, first: int, count: int) -> BaseMotion:
    """Return the base motion of a sweep on ``count`` intervals, beginning with interval ``first``."""
    time_s = np.arange(first, first + count + 1, dtype=np.float64) * interval_s
    turns = drive.turns(time_s)
    angle = 2.0 * np.pi * (turns - np.floor(turns))
    value = drive.amplitude_m * np.sin(angle)
    slope = 2.0 * np.pi * drive.frequency_hz(time_s) * drive.amplitude_m * np.cos(angle) * interval_s
    rise = np.diff(value)
    quadratic = 3.0 * rise - 2.0 * slope[:-1] - slope[1:]
    cubic = slope[:-1] + slope[1:] - 2.0 * rise
    scaled = np.column_stack([value[:-1], slope[:-1], quadratic, cubic])
    return BaseMotion(interval_s, np.ascontiguousarray(scaled / interval_s ** np.arange(4)))


LATEST_START_S = 1e8
"""Latest start time [s], about three years; double precision cannot resolve later times to 1e-8 s."""
MOST_SAMPLES = 1e9
"""Largest number of samples of a run; this number of samples needs 48 GB of memory."""
ROUNDING = 1e-9
"""Relative tolerance within which a duration counts as a whole number of samples or intervals."""


@dataclass(frozen=True, eq=False)
class Impacts:
    """Impacts of m1 on its stops during a run."""

    times_s: Floats
    """Times at which contacts begin, ascending, shape (count,) [s]."""

    @property
    def count(self) -> int:
        """Number of contacts that began during the run."""
        return len(self.times_s)


@dataclass(frozen=True, eq=False)
class Trajectory:
    """States, impacts and outcome of a run."""

    time_s: Floats
    """Sample times, shape (n,) [s]; empty if no sample rate was requested."""
    states: Floats
    """x, y, z, vx, vy, vz in the inertial frame, shape (n, 6) [m, m/s]."""
    final_state: Floats
    """x, y, z, vx, vy, vz at ``end_time_s``, shape (6,) [m, m/s]."""
    end_time_s: float
    impacts: Impacts
    outcome: Outcome
    """Outcome of the run; only REACHED_END means that the run reached the requested time."""
    accuracy: Accuracy


def integrate(
    specimen: Specimen,
    drive: Drive,
    duration_s: float,
    accuracy: Accuracy | AccuracyWord = Accuracy.STANDARD,
    initial_state: ArrayLike | None = None,
    sample_rate_hz: float | None = None,
    *,
    start_time_s: float = 0.0,
    max_impact_rate_hz: float = MAX_IMPACT_RATE_HZ,
) -> Trajectory:
    """Integrate the motion of a specimen under a drive.

    Motion without contact is exact for a harmonic drive; other drives are treated as piecewise cubics. Bounds
    on p ensure that no contact is missed. Contacts are integrated with the tolerance of ``accuracy``.
    Sampling does not change the time steps, so the motion is the same at any sample rate. Raises ValueError
    when an argument is not allowed, or the drive ends before the run.

    Parameters
    ----------
    specimen, drive
        Specimen, and motion of its base.
    duration_s
        Length of the run [s]; a sweep or a sampled drive must be at least as long.
    accuracy
        Accuracy level, which sets the relative tolerance of a time step in contact.
    initial_state
        x, y, z, vx, vy, vz in the inertial frame, shape (6,) [m, m/s]; None for rest. May be in contact.
    sample_rate_hz
        Rate of the samples at start_time_s + k / sample_rate_hz up to the end; None for no samples.
    start_time_s
        Time of the drive at which the run starts [s], for example to continue an earlier run.
    max_impact_rate_hz
        Mean impact rate above which the run ends with TOO_MANY_IMPACTS.
    """
    accuracy = member(Accuracy, accuracy)
    check_times(duration_s, start_time_s, sample_rate_hz)
    check_impact_rate(max_impact_rate_hz)
    end = float(start_time_s + duration_s)
    impacts = most_impacts(max_impact_rate_hz, duration_s)
    samples = 0 if sample_rate_hz is None else math.floor(duration_s * sample_rate_hz * (1.0 + ROUNDING)) + 1
    rate_hz = 1.0 if sample_rate_hz is None else float(sample_rate_hz)
    start = start_motion(initial_state)
    record = RunRecord(impacts, start_s=start_time_s, sample_rate_hz=rate_hz, samples=samples)
    run: NativeRun | CubicRun
    if isinstance(drive, Harmonic):
        run = NativeRun(specimen, drive, start, accuracy.tolerance, start_time_s=start_time_s)
        outcome = run.advance(end, record)
    else:
        run, outcome = integrate_cubics(specimen, drive, float(start_time_s), end, accuracy, start, record)
    is_whole = outcome is Outcome.REACHED_END
    # Because of rounding, the last sample time may lie just after the end of the run.
    states = record.all_samples(run.motion) if is_whole else record.samples
    return Trajectory(
        time_s=start_time_s + np.arange(len(states)) / rate_hz,
        states=states,
        final_state=run.motion,
        end_time_s=end if is_whole else run.time_s,
        impacts=Impacts(record.impact_times_s.copy()),
        outcome=outcome,
        accuracy=accuracy,
    )


def check_impact_rate(max_impact_rate_hz: float) -> None:
    """Raise ValueError if the limit of the impact rate is negative or infinite."""
    if not 0.0 <= max_impact_rate_hz < math.inf:
        raise ValueError(
            f"Impact rate {max_impact_rate_hz} Hz is not allowed: it must be zero or more, and finite."
        )


def check_times(duration_s: float, start_time_s: float, sample_rate_hz: float | None) -> None:
    """Raise ValueError for times or sample rates that are not allowed."""
    if not 0.0 <= duration_s < math.inf:
        raise ValueError(f"Duration {duration_s} s is not allowed: it must be zero or positive, and finite.")
    if not 0.0 <= start_time_s <= LATEST_START_S:
        raise ValueError(
            f"Start time {start_time_s} s is not allowed: it must lie between 0 and {LATEST_START_S:g} s."
        )
    if sample_rate_hz is not None and not 0.0 < sample_rate_hz < math.inf:
        raise ValueError(
            f"Sample rate {sample_rate_hz} Hz is not allowed: it must be positive and finite, or None."
        )
    if sample_rate_hz is not None and duration_s * sample_rate_hz > MOST_SAMPLES:
        raise ValueError(
            f"{duration_s * sample_rate_hz:.3g} samples are not allowed: give at most {MOST_SAMPLES:.1g}; "
            "lower the sample rate or shorten the run."
        )


def check_within(available_s: float, end_s: float) -> None:
    """Raise ValueError if the run lasts longer than the sweep or sampled drive."""
    if end_s > available_s * (1.0 + ROUNDING):
        raise ValueError(
            f"The run ends at {end_s} s, the drive at {available_s} s: shorten the run or extend the drive."
        )


BATCH = 1 << 16
"""Number of sweep intervals computed at once, limited to save memory in long sweeps."""


def integrate_cubics(
    specimen: Specimen,
    drive: Sampled | Sweep,
    start_s: float,
    end_s: float,
    accuracy: Accuracy,
    start: Floats,
    record: RunRecord,
) -> tuple[CubicRun, Outcome]:
    """Integrate a motion as `integrate` does, from ``start_s`` to ``end_s``; return run and outcome.

    Raises ValueError when the drive ends before the run.
    """
    check_within(drive.duration_s, end_s)
    if isinstance(drive, Sampled):
        base = sampled_motion(drive)
        interval = base.interval

        def cut(begin: int, stop: int) -> Floats:
            return base.pieces[begin:stop]
    else:
        interval = sweep_interval_s(drive, accuracy)

        def cut(begin: int, stop: int) -> Floats:
            return sweep_motion(drive, interval, begin, stop - begin).pieces

    run = CubicRun(specimen, interval, start, accuracy.tolerance, start_time_s=start_s)
    first, first_from = _place(start_s, interval)
    last, last_to = _place(end_s, interval)
    if last_to == 0.0:
        last, last_to = last - 1, interval
    outcome = Outcome.REACHED_END
    for begin in range(first, last + 1, BATCH):
        stop = min(begin + BATCH, last + 1)
        outcome = run.advance(
            cut(begin, stop),
            record,
            first_from_s=first_from if begin == first else 0.0,
            last_to_s=last_to if stop == last + 1 else interval,
        )
        if outcome is not Outcome.REACHED_END:
            break
    return run, outcome


def _place(time_s: float, interval_s: float) -> tuple[int, float]:
    """Return the index of the interval that contains a time, and the time since the interval's start [s]."""
    position = time_s / interval_s
    nearest = round(position)
    if abs(position - nearest) < ROUNDING * max(1.0, position):
        return nearest, 0.0
    return int(position), time_s - int(position) * interval_s


# Motion at each sample of a recorded base motion, to overlay a simulation on a recording. SI units.
#
# `integrate` offers more (impact times, any sample rate, any end) and takes several times longer. Here a run
# covers whole sample intervals. The state at the end of each is stored; impacts are counted.


@dataclass(frozen=True, eq=False)
class FollowedMotion:
    """States at the samples that a run reached, and numbers of impacts between them."""

    states: NDArray[np.float64]
    """x, y, z, vx, vy, vz at every sample in the inertial frame, shape (reached, 6) [m, m/s]."""
    impacts: NDArray[np.int64]
    """Number of contacts that began between each sample and the next, shape (reached - 1,)."""
    requested: int
    """Number of requested samples; larger than the number of states if the run ended early."""

    @property
    def reached_end(self) -> bool:
        """Whether the run reached every requested sample."""
        return len(self.states) == self.requested


def follow_samples(
    specimen: Specimen,
    drive: Sampled,
    accuracy: Accuracy | AccuracyWord = Accuracy.STANDARD,
    initial_state: ArrayLike | None = None,
    *,
    first: int = 0,
    last: int | None = None,
) -> FollowedMotion:
    """Return the motion of a specimen at each sample of its base displacement.

    Parameters
    ----------
    initial_state
        x, y, z, vx, vy, vz in the inertial frame, shape (6,) [m, m/s]; None for rest. May be in contact.
    first, last
        Samples at which the run begins and ends; by default the whole drive. The spline always uses all
        samples of the drive.
    """
    accuracy = member(Accuracy, accuracy)
    base = sampled_motion(drive)
    pieces = base.pieces[first:last]
    run = CubicRun(specimen, base.interval, start_motion(initial_state), accuracy.tolerance)
    first_state = run.motion
    record = RunRecord(most_impacts(MAX_IMPACT_RATE_HZ, len(pieces) * base.interval))
    motions, impacts = run.follow(pieces, record)
    return FollowedMotion(np.vstack([first_state, motions]), impacts.astype(np.int64), len(pieces) + 1)
