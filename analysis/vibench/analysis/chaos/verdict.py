"""Verdict on a recorded motion: periodic, quasi-periodic, chaotic or undecided.

A chaotic transient may end during a dwell, so the verdict applies to the last motion in the record.
"""

import math
from dataclasses import dataclass, replace
from enum import StrEnum
from itertools import pairwise
from typing import ClassVar

import numpy as np
from scipy.optimize import minimize_scalar

from ..errors import InvalidRequest, NotEnoughData, UnusableData
from ..signals import Reals
from ..tables import Tabular
from .witnesses import (
    FEWEST,
    Divergence,
    SurrogateTest,
    ZeroOne,
    delay_vectors,
    divergence,
    normal_scores,
    surrogate_test,
    time_symmetry,
    zero_one,
)

LONGEST_PERIOD = 32
_TABLE = 2
"""Number of dimensions of the array of Poincaré points; its shape is (drive periods, coordinates)."""
STEADY = 2e-3
"""Largest scatter of a steady motion's points, relative to the size of the orbit; real drives fluctuate."""
_NOISE_MARGIN = 1.5
"""Noise explains the points' scatter up to this ratio of the measured to the expected scatter."""
_REPEATED = 0.25
"""Largest variance of every n-th point relative to the variance of all points, if a period n exceeds one."""
_DRIFT_BLOCKS = 10
_DRIFT = 5.0
"""Largest drift [standard errors]; 1 settled record in 250 drifts more (4 slopes, 8 degrees of freedom)."""

_STEADY_SCATTER = 0.9
"""Minimum ratio of the smaller to the larger scatter in the two halves of a settled record."""


@dataclass(frozen=True, eq=False)
class Points(Tabular):
    """Poincaré points of a motion, one per drive period, and their noise; both relative to the orbit."""

    value: Reals
    """Displacement and velocity, each divided by the size of the orbit, shape (periods, 2)."""
    noise: Reals
    """Standard deviation of the noise of each coordinate, divided by the size of the orbit, shape (2,)."""

    def __post_init__(self) -> None:
        """Raise InvalidRequest for wrong shapes or invalid noise, UnusableData for non-finite points."""
        points, noise = np.shape(self.value), np.shape(self.noise)
        if len(points) != _TABLE or noise != points[1:]:
            raise InvalidRequest(
                f"points of shape {points} with noise of shape {noise} were given; points must have the "
                "shape (periods, 2), and their noise the shape (2,)"
            )
        if not np.all((np.asarray(self.noise) >= 0.0) & np.isfinite(self.noise)):
            raise InvalidRequest(
                f"a noise of {self.noise} is not allowed; give standard deviations, zero or more"
            )
        if not np.all(np.isfinite(self.value)):
            raise UnusableData(
                "points contain values that are not finite; choose a part without lost samples"
            )

    @property
    def spread(self) -> float:
        """RMS distance of the points from their mean, relative to the size of the orbit."""
        return float(np.sqrt(np.mean(np.var(self.value, axis=0))))

    @property
    def noise_level(self) -> float:
        """RMS noise of the points, relative to the size of the orbit."""
        return float(np.sqrt(np.mean(self.noise**2)))


def shortest_period(points: Points) -> int | None:
    """Return the smallest number of drive periods after which all points repeat within noise, or None.

    To test period n, every nth point is compared over the whole record, because slow changes are small from
    one period to the next. In addition to their noise, these points may scatter by 0.2 % of the orbit
    (unsteady drive). If n exceeds one, the points' scatter must also be below half of the total scatter.
    """
    by_noise = (_NOISE_MARGIN * points.noise) ** 2
    allowed = by_noise + STEADY**2
    count = len(points.value)
    for period in range(1, min(LONGEST_PERIOD, count // 4) + 1):
        whole = np.full((-(-count // period) * period, _TABLE), np.nan)
        whole[:count] = points.value
        scatter = np.nanvar(whole.reshape(-1, period, _TABLE), axis=0, ddof=1)
        if np.all(np.mean(scatter, axis=0) <= allowed):
            return period
        allowed = np.minimum(allowed, by_noise + _REPEATED * np.var(points.value, axis=0))
    return None


def drift(points: Points) -> float:
    """Return the largest trend of the points' mean or scatter over a record, in standard errors.

    A line is fitted to the values of ten equal parts of the record, and its slope is divided by its standard
    error. A scatter of 0.2 % of the orbit is tolerated as unsteadiness of the drive.
    """
    blocks = np.array_split(points.value, _DRIFT_BLOCKS)
    place = np.linspace(-0.5, 0.5, _DRIFT_BLOCKS)
    worst = 0.0
    for figure in (
        np.array([block.mean(axis=0) for block in blocks]),
        np.array([block.std(axis=0) for block in blocks]),
    ):
        slope = place @ figure / (place @ place)
        left = figure - figure.mean(axis=0) - np.outer(place, slope)
        variance = np.sum(left**2, axis=0) / (_DRIFT_BLOCKS - 2) + STEADY**2 / _DRIFT_BLOCKS
        worst = max(worst, float(np.max(np.abs(slope) / np.sqrt(variance / (place @ place)))))
    return worst


def slow_share(points: Points) -> float:
    """Return the variance of the means of ten parts of the record, relative to the variance of the points."""
    means = np.array([block.mean(axis=0) for block in np.array_split(points.value, _DRIFT_BLOCKS)])
    whole = float(np.sum(np.var(points.value, axis=0)))
    return float(np.sum(np.var(means, axis=0))) / whole if whole > 0.0 else 0.0


def is_settled(points: Points) -> bool:
    """Return whether mean and scatter of the points are constant over the record."""
    return drift(points) <= _DRIFT


def scatter_drifts(points: Points) -> bool:
    """Return whether the scatter of the points, however small, changes by a tenth or more over the record."""
    sizes = [Points(half, points.noise).spread for half in np.array_split(points.value, 2)]
    relative = Points(points.value / points.spread, points.noise)
    return min(sizes) < _STEADY_SCATTER * max(sizes) and not is_settled(relative)


_HARMONICS = 8
_EXPLAINED = 0.02
"""Points lie on a closed curve if their RMS distance from it, relative to their spread, is at most this."""
_CLEAR = 0.8
"""Largest value to which noise of the points may raise the limit `_EXPLAINED`."""
_MAINS_HZ = (50.0, 60.0)
_MAINS_HARMONICS = 3
_MAINS_WITHIN = 1e-3
"""Relative tolerance of the mains frequency."""


@dataclass(frozen=True)
class Rotation:
    """Closed curve that fits the points of a Poincaré section best."""

    turns_per_period: float
    """Rotation number: turns per drive period, 0 to 0.5."""
    left_over: float
    """RMS distance of the section's points from the curve, relative to the spread of these points."""


def rotation(points: Reals) -> Rotation:
    """Fit a closed curve, a sum of harmonics of one frequency, to the points of a section.

    Parameters
    ----------
    points
        Shape (periods, coordinates).
    """
    centred = points - points.mean(axis=0)
    count = len(centred)
    window = np.hanning(count)[:, np.newaxis]
    power = np.sum(np.abs(np.fft.rfft(window * centred, axis=0)) ** 2, axis=1)
    strongest = int(np.argmax(power[1:])) + 1
    best = minimize_scalar(
        lambda turns: _residual(centred, turns),
        bounds=((strongest - 1) / count, (strongest + 1) / count),
        method="bounded",
        options={"xatol": 1e-3 / count**1.5},
    )
    spread = float(np.sqrt(np.mean(centred**2)))
    return Rotation(float(best.x), float(best.fun) / spread if spread > 0 else 0.0)


def mains_hz(found: Rotation, drive_hz: float, periods: int) -> float | None:
    """Return the mains frequency, or a harmonic of it, that explains a rotation number; None if none fits."""
    for mains in _MAINS_HZ:
        for hum_hz in mains * np.arange(1, _MAINS_HARMONICS + 1):
            turns = hum_hz / drive_hz
            seen = abs(turns - round(turns))
            if abs(seen - found.turns_per_period) <= _MAINS_WITHIN * turns + 0.5 / periods:
                return float(hum_hz)
    return None


def _residual(centred: Reals, turns: float) -> float:
    angle = 2 * np.pi * turns * np.arange(len(centred))[:, np.newaxis] * np.arange(1, _HARMONICS + 1)
    basis = np.hstack((np.cos(angle), np.sin(angle), np.ones((len(centred), 1))))
    fitted, *_ = np.linalg.lstsq(basis, centred, rcond=None)
    return float(np.sqrt(np.mean((centred - basis @ fitted) ** 2)))


_BLOCKS = 10
_SHORTEST_BLOCK = 50
"""Minimum number of drive periods per block, enough to see whether a motion repeats."""


def begin_of_last_motion(points: Points) -> int:
    """Return the index at which the last motion of a record starts; 0 if the motion never changes.

    Each block of the record is tested for repetition within its noise. If the result changes once, a
    transient ended or a motion was lost. If it changes several times, the motion is chaos with periodic
    intervals, which counts as one motion.
    """
    count = len(points.value)
    edges = np.linspace(0, count, max(min(_BLOCKS, count // _SHORTEST_BLOCK), 1) + 1).astype(int)
    repeats = np.array(
        [
            shortest_period(Points(points.value[first:stop], points.noise)) is not None
            for first, stop in pairwise(edges)
        ]
    )
    changes = np.flatnonzero(repeats[1:] != repeats[:-1])
    if changes.size != 1:
        return 0
    # The motion changes at an unknown place in the block that does not repeat.
    last = int(changes[0]) + 1
    return int(edges[last] if repeats[-1] else edges[min(last + 1, len(edges) - 1)])


MOST_POINTS = 3000
"""Maximum number of last points of a record used to test the section's shape; more would only cost time."""
ABOVE_NOISE = 5.0
"""Minimum ratio of the points' scatter to their noise for tests of the shape of the section."""
LARGEST_NOISE = 0.1
"""Largest ratio of noise to the size of the orbit; more noise could hide another motion."""
SMALL = 0.05
"""Largest scatter at which a motion with linear noise counts as periodic, relative to the orbit's size."""
SLOW = 0.5
"""Largest `slow_share` of a motion that does not change slowly."""
_FEWEST_TURNS = 3.0
"""Minimum number of turns around a closed curve during a record; fewer turns count as a slow change."""
_LARGEST_HUM = 0.1
"""Largest component at the mains frequency, relative to the orbit, that counts as hum, not as motion."""
_LOW_PERIOD = 4
"""Longest period that counts as short; mains hum at half the drive frequency causes such periods."""
CHAOTIC_K = 0.9
_BEYOND_CHANCE = 3.5
"""Minimum `margin` if values are replaced by normal scores; a rank test alone errs once in 40 cases."""
_ASYMMETRIC = 2.5
"""Minimum `margin` of the time symmetry; in 4 % of cases, noise in one of two coordinates exceeds it."""
_SURELY = 3.0
"""Distance of an exponent's lower bound below its estimate, in standard deviations of the estimate."""
_DELAYS = 3
_STEPS = 8


class MotionKind(StrEnum):
    """Kind of motion when the base is driven by a sine."""

    PERIODIC = "periodic"
    QUASI_PERIODIC = "quasi-periodic"
    CHAOTIC = "chaotic"
    UNDECIDED = "undecided"
    """The recording allows no verdict; `MotionVerdict.why` states the reason."""


@dataclass(frozen=True, eq=False)
class Evidence:
    """Results of the tests for a verdict; the result of a test that was not needed is None."""

    drive_hz: float
    periods: int
    """Number of drive periods used for the tests."""
    spread: float
    """Scatter of the points, relative to the size of the orbit."""
    noise: float
    """Noise of the points relative to the size of the orbit."""
    is_settled: bool
    rotation: Rotation | None = None
    zero_one: ZeroOne | None = None
    surrogates: SurrogateTest | None = None
    divergence: Divergence | None = None


@dataclass(frozen=True, eq=False)
class MotionVerdict(Tabular):
    """Kind of a recorded motion, with the reason for this verdict."""

    DOCUMENT: ClassVar = (
        "kind why period periods_judged=evidence.periods is_settled=evidence.is_settled "
        "scatter_over_orbit=evidence.spread noise_over_orbit=evidence.noise zero_one_k=evidence.zero_one.k "
        "surrogates_p=evidence.surrogates.p turns_per_period=evidence.rotation.turns_per_period "
        "least_lyapunov_per_s=least_exponent_per_s"
    )

    kind: MotionKind
    why: str
    evidence: Evidence
    period: int | None = None
    """Number of drive periods after which a periodic motion repeats itself."""

    @property
    def text(self) -> str:
        """Kind of motion in a few words."""
        if self.kind is MotionKind.PERIODIC and self.period is not None and self.period > 1:
            return f"periodic, {self.period} drive periods"
        return self.kind.value

    @property
    def least_exponent_per_s(self) -> float | None:
        """Lower bound on the largest Lyapunov exponent of a chaotic motion; None if unresolved.

        Noise and the finite size of the motion reduce the estimate by an unknown amount, up to a half. Points
        that scatter for reasons other than chaos diverge as well.
        """
        parting = self.evidence.divergence
        if self.kind is not MotionKind.CHAOTIC or parting is None or not parting.is_resolved:
            return None
        least = parting.exponent - _SURELY * parting.sd_exponent
        return least * self.evidence.drive_hz if least > 0.0 else None


def motion_verdict(points: Points, drive_hz: float, *, seed: int = 0) -> MotionVerdict:
    """Return the verdict on a motion from its points, one per drive period.

    A motion is *periodic* if its points repeat within their noise, and *quasi-periodic* if they lie on a
    closed curve. It is *chaotic* only if all tests agree: the points are settled, far above the noise and on
    no closed curve, the 0-1 test is near one without oversampling, and surrogates reject linear noise. Each
    test alone would accept some noise as chaos. If any test fails, the verdict is undecided. If the motion
    changes once, as at the end of a chaotic transient, only the last part is classified. Its period must be
    at most 4, or it must be the longer part. If the noise exceeds a tenth of the orbit, the verdict is
    undecided. Raises InvalidRequest when the drive frequency is not positive and finite.

    Parameters
    ----------
    points
        Points of all drive periods; all are tested for repetition, the last 3000 for the shape.
    drive_hz
        Drive frequency, to convert exponents per period to exponents per second.
    seed
        Seed of the random frequencies and surrogates.
    """
    if not 0.0 < drive_hz < math.inf:
        raise InvalidRequest(f"a drive frequency of {drive_hz} Hz is not allowed; give a positive frequency")
    count = len(points.value)
    if count < FEWEST:
        return _too_few(
            f"{count} drive periods remain without the disturbed ends, but {FEWEST} are needed; dwell longer",
            points,
            drive_hz,
        )
    before = begin_of_last_motion(points)
    if before == 0:
        return _of_one_motion(points, drive_hz, seed)
    rest = Points(points.value[before:], points.noise)
    too_late = "before the end, too late to classify the new motion; dwell longer"
    if count - before < FEWEST:
        return _too_few(f"a change occurred fewer than {FEWEST} drive periods {too_late}", rest, drive_hz)
    found = _of_one_motion(rest, drive_hz, seed)
    # A motion that repeats at the end is settled, however long its transient was. An irregular end, or a long
    # period, may be a transient: for example, points that rotate about a fixed point and decay into noise.
    if (found.period or math.inf) > _LOW_PERIOD and count - before <= before:
        return _no_verdict(f"a change occurred {count - before} drive periods {too_late}", found.evidence)
    return replace(found, why=f"{found.why}; this holds only for the last {len(rest.value)} drive periods")


def _of_one_motion(last: Points, drive_hz: float, seed: int) -> MotionVerdict:
    evidence = Evidence(drive_hz, len(last.value), last.spread, last.noise_level, is_settled=is_settled(last))
    if not evidence.is_settled:
        return _no_verdict(
            "the motion still changes: its mean or its scatter drifts; let the motion settle for longer",
            evidence,
        )
    if last.noise_level > LARGEST_NOISE:
        return _no_verdict(
            f"noise is {100 * last.noise_level:.0f} % of the orbit, too much to show that the motion "
            "repeats; raise the level or use a finer vibrometer range",
            evidence,
        )
    period = shortest_period(last)
    if (period or math.inf) > _LOW_PERIOD and scatter_drifts(last):
        return _no_verdict("the scatter of the points still changes; let the motion settle longer", evidence)
    if period is None:
        return _aperiodic(Points(last.value[-MOST_POINTS:], last.noise), evidence, seed)
    if period > 1:
        found = rotation(last.value)
        hum_hz = mains_hz(found, drive_hz, len(last.value))
        if hum_hz is not None and (period > _LOW_PERIOD or last.spread <= _LARGEST_HUM):
            return _hum_verdict(replace(evidence, rotation=found), hum_hz, period)
    every = "drive period" if period == 1 else f"{period} drive periods"
    why = f"the points repeat every {every} to within their noise"
    return MotionVerdict(MotionKind.PERIODIC, why, evidence, period)


def _hum_verdict(evidence: Evidence, hum_hz: float, period: int | None) -> MotionVerdict:
    """Return the verdict on a motion with mains hum: periodic if the hum is small, otherwise undecided."""
    if evidence.spread <= _LARGEST_HUM and (period is None or period > _LOW_PERIOD):
        why = (
            f"the points repeat every drive period, except for {100 * evidence.spread:.2g} % of the orbit at "
            f"{hum_hz:g} Hz, which is mains hum"
        )
        return MotionVerdict(MotionKind.PERIODIC, why, evidence, 1)
    return _no_verdict(
        f"{100 * evidence.spread:.2g} % of the orbit is at {hum_hz:g} Hz, which may be mains hum or motion; "
        "dwell at another frequency",
        evidence,
    )


def _too_few(why: str, points: Points, drive_hz: float) -> MotionVerdict:
    return _no_verdict(
        why, Evidence(drive_hz, len(points.value), np.nan, points.noise_level, is_settled=False)
    )


def _no_verdict(why: str, evidence: Evidence) -> MotionVerdict:
    return MotionVerdict(MotionKind.UNDECIDED, why, evidence)


def _aperiodic(points: Points, so_far: Evidence, seed: int) -> MotionVerdict:
    found = rotation(points.value)
    evidence = replace(so_far, rotation=found)
    is_curve = found.left_over <= min(
        max(_EXPLAINED, _NOISE_MARGIN * (evidence.noise / evidence.spread)), _CLEAR
    )
    turns = found.turns_per_period * len(points.value)
    if slow_share(points) > SLOW or (is_curve and turns < _FEWEST_TURNS):
        return _no_verdict(
            f"the motion varies slowly, by {100 * evidence.spread:.2g} % of the orbit, with fewer than "
            f"{_FEWEST_TURNS:g} cycles in the record; record longer",
            evidence,
        )
    if is_curve:
        hum_hz = mains_hz(found, so_far.drive_hz, len(points.value))
        if hum_hz is not None:
            return _hum_verdict(evidence, hum_hz, None)
        why = f"the points move along a closed curve, by {found.turns_per_period:.4f} turns per drive period"
        return MotionVerdict(MotionKind.QUASI_PERIODIC, why, evidence)
    if evidence.spread < ABOVE_NOISE * evidence.noise:
        if evidence.spread <= SMALL:
            why = (
                f"the points stay within {100 * evidence.spread:.1f} % of the orbit, not clearly above their "
                "noise"
            )
            return MotionVerdict(MotionKind.PERIODIC, why, evidence, 1)
        return _no_verdict(
            f"the scatter of the points is {evidence.spread / evidence.noise:.1f} times their noise, but "
            f"{ABOVE_NOISE:g} times are needed; raise the level or use a finer vibrometer range",
            evidence,
        )
    line = np.asarray(points.value[:, int(np.argmax(np.std(points.value, axis=0)))])
    test, noise_test = zero_one(line, seed=seed), surrogate_test(line, seed=seed)
    bent_test = _bent_test(points, seed) if noise_test.rejects_linear_noise else noise_test
    try:
        space = delay_vectors(points.value, _DELAYS)
        parting = divergence(space, steps=_STEPS, noise=points.noise_level)
    except NotEnoughData:
        parting = None
    evidence = replace(evidence, zero_one=test, surrogates=bent_test, divergence=parting)
    return _verdict(evidence, test, noise_test, bent_test)


def _bent_test(points: Points, seed: int) -> SurrogateTest:
    """Test for noise after a static nonlinearity: by ranks if it is monotone, otherwise by time symmetry."""
    ranked = [surrogate_test(normal_scores(each), seed=seed) for each in points.value.T]
    weakest, strongest = max(ranked, key=lambda each: each.p), max(ranked, key=lambda each: each.margin)
    if not weakest.rejects_linear_noise:
        return weakest
    strongest = replace(strongest, least_margin=_BEYOND_CHANCE)
    if not strongest.rejects_linear_noise:
        return strongest
    in_time = [surrogate_test(each, time_symmetry, seed=seed) for each in points.value.T]
    return replace(max(in_time, key=lambda each: each.margin), least_margin=_ASYMMETRIC)


def _verdict(
    evidence: Evidence, test: ZeroOne, noise_test: SurrogateTest, bent_test: SurrogateTest
) -> MotionVerdict:
    if not noise_test.is_valid:
        return _no_verdict(
            f"the spectra of surrogate signals are wrong by {100 * noise_test.spectrum_error:.0f} %, so "
            "linear noise cannot be excluded; record longer",
            evidence,
        )
    if not noise_test.rejects_linear_noise:
        return _noisy(evidence, noise_test)
    if not bent_test.rejects_linear_noise:
        return _no_verdict(
            f"noise after a static nonlinearity also fits the points (p = {bent_test.p:.2f}); record longer",
            evidence,
        )
    if test.is_oversampled:
        return _no_verdict(
            f"neighbouring points are correlated ({test.neighbour_correlation:.2f}), so the 0-1 test is "
            "not valid; record longer",
            evidence,
        )
    if test.k < CHAOTIC_K:
        return _no_verdict(f"0-1 test: {test.k:.2f}, neither regular nor chaotic; record longer", evidence)
    above = "" if evidence.noise == 0.0 else f"{evidence.spread / evidence.noise:.0f} times above the noise, "
    why = (
        f"the points are settled, {above}and not on a closed curve; the 0-1 test gives {test.k:.3f}, and "
        f"linear noise is excluded (p = {noise_test.p:.3f})"
    )
    return MotionVerdict(MotionKind.CHAOTIC, why, evidence)


def _noisy(evidence: Evidence, noise_test: SurrogateTest) -> MotionVerdict:
    """Return the verdict if linear noise explains the points: periodic for small noise, else undecided."""
    if evidence.spread > SMALL:
        return _no_verdict(f"linear noise also explains the points (p = {noise_test.p:.2f})", evidence)
    why = (
        f"the points scatter about one point by {100 * evidence.spread:.1f} % of the orbit, like linear "
        f"noise (p = {noise_test.p:.2f}), but by more than the vibrometer noise"
    )
    return MotionVerdict(MotionKind.PERIODIC, why, evidence, 1)
