"""Follow a curve of solutions through its folds: pseudo-arclength continuation.

The n equations r(u, lambda) = 0 in n unknowns and one parameter define a curve in n + 1 dimensions. Each step
follows the tangent of the curve and is then corrected perpendicular to the tangent (Keller 1977; Allgower and
Georg, Introduction to Numerical Continuation Methods, SIAM 2003, chapters 2, 6 and 9). Folds need no special
treatment: the last component of the tangent changes sign there. Unknowns and parameter must be of order one.
"""

import math
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Protocol

import numpy as np

from ..specimen.specimen import Floats


class Curve(Protocol):
    """Equations r(u, lambda) = 0 whose solutions form the curve."""

    def linearise(self, point: Floats) -> tuple[Floats, Floats]:
        """Return r, shape (n,), and dr/dpoint, shape (n, n + 1), at a point (u, lambda), shape (n + 1,).

        Return NaN or infinite values where the equations cannot be evaluated.
        """
        ...


@dataclass(frozen=True)
class ArcSteps:
    """Step lengths, tolerances and limits for following a curve."""

    first: float = 0.01
    """Length of the first step along the curve."""
    longest: float = 0.05
    shortest: float = 1e-7
    """Shortest length of a step along the curve."""
    most_turn_rad: float = 0.3
    """Largest rotation of the tangent in a step."""
    tolerance: float = 1e-10
    """Largest residual of a point on the curve."""
    most_points: int = 2000
    until_s: float = math.inf
    """Time limit for following the curve, as a value of `time.monotonic` [s]."""


class ArcEnd(StrEnum):
    """Reason for the end of a curve."""

    REACHED_BOUND = "the parameter reached an end of its range"
    CLOSED = "the branch closed on itself: an isolated one"
    JOINED = "the branch ended at a motion with a shorter period or a higher symmetry"
    TOO_MANY_POINTS = "more points than allowed: raise most_points, or lengthen the longest step"
    OUT_OF_TIME = "the requested time was over"
    STEP_TOO_SHORT = (
        "no solution within the shortest step: a kink or an end of the branch, or too few harmonics"
    )


@dataclass(frozen=True, eq=False)
class ArcPoint:
    """One point of a curve."""

    point: Floats
    """Point (u, lambda), shape (n + 1,)."""
    tangent: Floats
    """Unit tangent in the direction of travel, shape (n + 1,)."""
    arc: float = 0.0
    """Arc length from the first point of the curve."""
    is_fold: bool = False
    """Whether the parameter reverses here (a fold); a fold is inserted between two steps."""
    end: ArcEnd | None = None
    """Reason why the curve ends at this point; None for all points before the last."""


NEWTON_ITERATIONS = 12
TARGET_ITERATIONS = 4
"""Number of Newton iterations that leaves the step length unchanged; after fewer iterations it grows."""
FARTHEST_ASIDE = 0.5
"""Largest allowed Newton correction, relative to the step length; a larger one could reach another branch."""
LEAP_GROWTH = 10.0
"""Ratio of successive step lengths that are tried across a kink."""
LONGEST_LEAP = 5.0
"""Largest distance between the points before and after a kink, relative to the tried step length."""
LOCATING_ITERATIONS = 40
LOCATED = 1e-9
"""Value below which a test function, such as a component of the tangent, counts as zero."""
CRAWLING, MOST_CRAWLED = 10.0, 50
"""More than MOST_CRAWLED successive steps, all below CRAWLING times the shortest step, indicate a kink."""
NEAR_START = 0.2
"""Distance from the curve's first point, in step lengths, below which the curve may have closed."""
SAME_POINT = 1e-6
"""Distance below which two points count as the same point of the curve."""
SHORTEST_BRACKET = 1e-12
"""Length of the bracketing interval at which the search for a zero ends."""


def correct(curve: Curve, guess: Floats, normal: Floats, tolerance: float) -> tuple[Floats, int]:
    """Correct ``guess`` by Newton's method in the hyperplane perpendicular to ``normal``.

    Return the point and the number of iterations; the number is 0 if the method did not converge.
    """
    point = guess.copy()
    for iteration in range(1, NEWTON_ITERATIONS + 1):
        residual, jacobian = curve.linearise(point)
        if not bool(np.all(np.isfinite(residual)) and np.all(np.isfinite(jacobian))):
            return point, 0
        if float(np.max(np.abs(residual))) < tolerance:
            return point, iteration
        system = np.vstack([jacobian, normal])
        aside = float(normal @ (point - guess))
        try:
            point = point - np.linalg.solve(system, np.append(residual, aside))
        except np.linalg.LinAlgError:
            return point, 0
    return point, 0


def tangent_at(curve: Curve, point: Floats, along: Floats) -> Floats:
    """Return the unit tangent at a point, in the direction of ``along``, shape (n + 1,)."""
    _, jacobian = curve.linearise(point)
    system = np.vstack([jacobian, along])
    aim = np.zeros(len(point))
    aim[-1] = 1.0
    try:
        direction = np.linalg.solve(system, aim)
    except np.linalg.LinAlgError:
        direction = np.linalg.svd(jacobian)[2][-1]
    direction = direction / np.linalg.norm(direction)
    return np.asarray(direction * math.copysign(1.0, float(direction @ along)))


def trace(
    curve: Curve, start: Floats, toward: float, bounds: tuple[float, float], steps: ArcSteps
) -> Iterator[ArcPoint]:
    """Follow the curve from one of its points until the parameter leaves its range.

    Yield the start, then each point, and folds in between. `end` of the last point is the reason for the end.

    Parameters
    ----------
    curve
        Equations; unknowns and parameter scaled to the order of one.
    start
        Point on the curve within the tolerance, shape (n + 1,).
    toward
        Direction in which the parameter first changes: up if positive, down if negative.
    bounds
        Range of the parameter, ends included.
    steps
        Step lengths and tolerances.
    """
    along = np.zeros(len(start))
    along[-1] = math.copysign(1.0, toward)
    here = first = ArcPoint(start, tangent_at(curve, start, along))
    yield here
    step, slow, leapt_at = steps.first, 0, -math.inf
    for _ in range(steps.most_points):
        if time.monotonic() > steps.until_s:
            yield replace(here, end=ArcEnd.OUT_OF_TIME)
            return
        ahead, step = _advance(curve, here, step, steps)
        slow = slow + 1 if step < CRAWLING * steps.shortest else 0
        if ahead is None or slow > MOST_CRAWLED:
            # Two kinks are so close together that no smooth curve lies between them: end here.
            is_stuck = here.arc - leapt_at < 2 * MOST_CRAWLED * CRAWLING * steps.shortest
            slow, leapt_at = 0, here.arc
            ahead = None if is_stuck else _leap_kink(curve, here, steps)
            if ahead is None:
                yield replace(here, end=ArcEnd.STEP_TOO_SHORT)
                return
            if ahead.tangent[-1] * here.tangent[-1] < 0.0:
                yield replace(here, is_fold=True)
            step = steps.first
            yield ahead
            here = ahead
            continue
        fold = _fold_between(curve, here, ahead, steps)
        inside = bounds[0] < ahead.point[-1] < bounds[1]
        if fold is not None and bounds[0] <= fold.point[-1] <= bounds[1]:
            yield fold
        if not inside:
            yield _point_at_bound(curve, here if fold is None else fold, ahead, bounds, steps)
            return
        if _passes(curve, first, here, ahead, steps):
            arc = here.arc + float(np.linalg.norm(first.point - here.point))
            yield replace(first, arc=arc, end=ArcEnd.CLOSED)
            return
        yield ahead
        here = ahead
    yield replace(here, end=ArcEnd.TOO_MANY_POINTS)


def _advance(curve: Curve, here: ArcPoint, step: float, steps: ArcSteps) -> tuple[ArcPoint | None, float]:
    """Take a step, shortened until Newton's method converges; return the new point and next step length."""
    while step >= steps.shortest:
        guess = here.point + step * here.tangent
        point, iterations = correct(curve, guess, here.tangent, steps.tolerance)
        aside = float(np.linalg.norm(point - guess))
        if iterations > 0 and aside < FARTHEST_ASIDE * step + SAME_POINT:
            tangent = tangent_at(curve, point, here.tangent)
            turn = math.acos(min(1.0, float(tangent @ here.tangent)))
            if turn <= steps.most_turn_rad:
                made = float(np.linalg.norm(point - here.point))
                ahead = ArcPoint(point, tangent, here.arc + made)
                effort: float = 2.0 ** ((TARGET_ITERATIONS - iterations) / 2.0)
                bend = 0.6 * steps.most_turn_rad / max(turn, 1e-12)
                return ahead, min(steps.longest, step * min(2.0, max(0.5, min(effort, bend))))
        step *= 0.5
    return None, step


def _passes(curve: Curve, start: ArcPoint, here: ArcPoint, ahead: ArcPoint, steps: ArcSteps) -> bool:
    """Return whether a step has passed the first point of the curve, so that the curve is closed."""
    step = ahead.point - here.point
    length = float(np.linalg.norm(step))
    part = float((start.point - here.point) @ step) / length**2
    nearest = here.point + part * step
    aside = float(np.linalg.norm(start.point - nearest))
    if here is start or not 0.0 < part <= 1.0 or aside > NEAR_START * length:
        return False
    if float(start.tangent @ ahead.tangent) < 0.0:
        return False
    # Points of other curves may be equally close, so follow this curve to its first point.
    guess = nearest + start.tangent * float((start.point - nearest) @ start.tangent)
    point, iterations = correct(curve, guess, start.tangent, steps.tolerance)
    return iterations > 0 and float(np.linalg.norm(point - start.point)) < SAME_POINT


def _leap_kink(curve: Curve, here: ArcPoint, steps: ArcSteps) -> ArcPoint | None:
    """Return a point beyond a kink, where a contact begins and the branch may turn back; None if not found.

    At a kink, the parameter may reverse while the unknowns continue. Steps of growing length are tried along
    the tangent, and along the tangent with reversed parameter; any rotation of the tangent is allowed.
    """
    mirrored = here.tangent.copy()
    mirrored[-1] = -mirrored[-1]
    length = LEAP_GROWTH * steps.shortest
    while length <= steps.longest:
        for along in (here.tangent, mirrored):
            point, iterations = correct(curve, here.point + length * along, along, steps.tolerance)
            if iterations > 0:
                made = float(np.linalg.norm(point - here.point))
                tangent = tangent_at(curve, point, point - here.point)
                if made < LONGEST_LEAP * length and float(tangent @ along) > 0.0:
                    return ArcPoint(point, tangent, here.arc + made)
        length *= LEAP_GROWTH
    return None


def _fold_between(curve: Curve, before: ArcPoint, after: ArcPoint, steps: ArcSteps) -> ArcPoint | None:
    """Return the fold between two points; None if there is no fold, or the fold cannot be located."""
    if before.tangent[-1] * after.tangent[-1] >= 0.0:
        return None
    found = locate(curve, before, after, lambda point: float(point.tangent[-1]), steps.tolerance)
    return None if found is None else replace(found, is_fold=True)


Measure = Callable[[ArcPoint], float]
"""Test function on the curve, which changes sign at an event."""


def locate(
    curve: Curve, before: ArcPoint, after: ArcPoint, measure: Measure, tolerance: float
) -> ArcPoint | None:
    """Return the point between two neighbours at which ``measure`` vanishes, found by regula falsi.

    None if no point of the curve is found between the neighbours.
    """
    low, high = before, after
    value_low, value_high = measure(before), measure(after)
    found, moved = after, 0
    for _ in range(LOCATING_ITERATIONS):
        between = _between(curve, low, high, value_low / (value_low - value_high), tolerance)
        if between is None:
            return None if found is after else found
        found = between
        value = measure(found)
        if abs(value) < LOCATED or float(np.linalg.norm(high.point - low.point)) < SHORTEST_BRACKET:
            break
        # Illinois method: if one end stays in place twice, halve the function value at this end.
        if value * value_low < 0.0:
            high, value_high = found, value
            value_low *= 0.5 if moved > 0 else 1.0
            moved = 1
        else:
            low, value_low = found, value
            value_high *= 0.5 if moved < 0 else 1.0
            moved = -1
    return found


def _between(curve: Curve, low: ArcPoint, high: ArcPoint, part: float, tolerance: float) -> ArcPoint | None:
    """Return a point of the curve between two points, if possible at a given fraction of the chord."""
    chord = high.point - low.point
    length = float(np.linalg.norm(chord))
    if length == 0.0:
        return None
    chord = chord / length
    for share in (part, 0.5 * (1.0 + part), 0.5 * part, 0.9, 0.1, 0.99, 0.01):
        point, iterations = correct(curve, low.point + share * length * chord, chord, tolerance)
        if iterations > 0 and float(np.linalg.norm(point - low.point)) <= 2.0 * length:
            arc = low.arc + float(np.linalg.norm(point - low.point))
            return ArcPoint(point, tangent_at(curve, point, chord), arc)
    return None


def _point_at_bound(
    curve: Curve, before: ArcPoint, after: ArcPoint, bounds: tuple[float, float], steps: ArcSteps
) -> ArcPoint:
    """Return the point of the curve at the parameter bound that the step has passed."""
    bound = bounds[0] if after.point[-1] <= bounds[0] else bounds[1]
    span = after.point[-1] - before.point[-1]
    part = (bound - before.point[-1]) / span if span != 0.0 else 1.0
    guess = before.point + part * (after.point - before.point)
    guess[-1] = bound
    across = np.zeros(len(guess))
    across[-1] = 1.0
    point, iterations = correct(curve, guess, across, steps.tolerance)
    if iterations == 0:
        return replace(before, end=ArcEnd.STEP_TOO_SHORT)
    arc = before.arc + float(np.linalg.norm(point - before.point))
    return ArcPoint(point, tangent_at(curve, point, before.tangent), arc, end=ArcEnd.REACHED_BOUND)
