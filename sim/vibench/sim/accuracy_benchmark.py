"""Curve of error against computing time, for one scene and every suitable method, on this machine.

>>> from vibench.sim import Harmonic, Scene, Target, gong2025
>>> from vibench.sim.accuracy_benchmark import scene_curve
>>> scene = Scene(gong2025(contact="linear"), Harmonic(260.0, 1e-6), target=Target(error=0.01))
>>> next(scene_curve(scene)).method
'closed form'
"""

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from .engine.run import Accuracy, check_time, time_limit
from .periodic.balance_branch import BalanceOptions, balance
from .periodic.first_order_balance import first_order_states
from .periodic.harmonic_balance import BalanceEnd, HarmonicSet, structure_of
from .periodic.restoring_force import PowerSpring, spring_of
from .periodic.shooting import ShootingEnd, periodic_orbit
from .scene.prediction import Method, ScenePrediction
from .scene.refinement import LONGEST_S, refine_scene
from .scene.scene import AutomaticDuration, FixedDuration, Scene
from .scene.solve import solve_scene
from .specimen.specimen import Floats

REFINED = "requested error"
TOLERANCES = (1e-2, 1e-4)
"""Relative tolerances of the harmonic balance with many harmonics: one for each point of the curve."""


@dataclass(frozen=True)
class CurvePoint:
    """Error and computing time of one method for a scene."""

    method: str
    time_s: float
    """Processor time that the method takes for the scene [s]."""
    error: float
    """Largest relative error among the Responses I and II of x and p."""
    response_i: float
    response_ii: float
    is_stated: bool
    """Whether the method estimates its error; if not, ``error`` is the deviation from the refined result."""
    is_chosen: bool = False
    """Whether `refine_scene` returns this result for the scene's target error and time."""


Answer = tuple[Floats, float | None]
"""Responses I and II of x, then of p, and the largest of their relative errors (None if not estimated)."""


def scene_curve(scene: Scene) -> Iterator[CurvePoint]:
    """Yield error and computing time of all suitable methods for a scene with a target.

    The first points are the successive results of `refine_scene`, until the target is met. These points take
    at most half of the time limit; methods that exceed the remaining time are left out. Raises ValueError
    when the scene has no target, or cannot be simulated.
    """
    end_s = time.monotonic()
    next(refine_scene(scene))  # not timed: includes work that is done once per process
    if scene.target is not None:
        limit_s = LONGEST_S if scene.target.time_s is None else scene.target.time_s
        end_s += limit_s
        scene = replace(scene, target=replace(scene.target, time_s=0.5 * limit_s))
    refined, times_s, began_s = list[ScenePrediction](), list[float](), time.thread_time()
    for found in refine_scene(scene):
        refined.append(found)
        times_s.append(time.thread_time() - began_s)
    best = _responses(refined[-1])
    if refined[-1].error_estimate is None:
        return
    is_closed = refined[-1].method is Method.CLOSED_FORM
    name = "closed form" if is_closed else REFINED
    for found, taken_s in zip(refined, times_s, strict=True):
        if found.error_estimate is not None:
            two = _pair(found)
            yield CurvePoint(
                name, taken_s, found.error_estimate, *two, is_stated=True, is_chosen=found is refined[-1]
            )
    for method, answer in _methods(scene):
        began_s = time.thread_time()
        try:
            with time_limit(end_s):
                check_time()
                given = answer()
        except (ValueError, TimeoutError):
            continue
        taken_s = time.thread_time() - began_s
        if given is None:
            continue
        responses, stated = given
        error = float(np.max(np.abs(responses / best - 1.0))) if stated is None else stated
        two = float(responses[0]), float(responses[1])
        yield CurvePoint(method, taken_s, error, *two, is_stated=stated is not None)


def _methods(scene: Scene) -> Iterator[tuple[str, Callable[[], Answer | None]]]:
    window_s = scene.duration.window_s
    yield "first-order balance", partial(_first_order, scene)
    for level in Accuracy:
        yield f"30 s, {level}", partial(_solve, scene, level, partial(FixedDuration, window_s=window_s))
        yield f"until settled, {level}", partial(_solve, scene, level, partial(AutomaticDuration, window_s))
    yield "shooting", partial(_shoot, scene)
    for tolerance in TOLERANCES:
        yield f"many-harmonic balance, {tolerance:g}", partial(_balance, scene, tolerance)


def _solve(
    scene: Scene, level: Accuracy, duration: Callable[[], FixedDuration | AutomaticDuration]
) -> Answer | None:
    variant = Scene(
        scene.specimen, scene.drive, accuracy=level, duration=duration(), start=scene.start, budget_s=0.0
    )
    found = solve_scene(variant)
    return None if found.error_estimate is None else (_responses(found), found.error_estimate)


def _shoot(scene: Scene) -> Answer | None:
    orbit = periodic_orbit(scene.specimen, scene.drive)
    if orbit.outcome is not ShootingEnd.CONVERGED or not orbit.is_stable:
        return None
    return np.array([orbit.response_i[0], orbit.response_ii[0], orbit.response_i[3], orbit.response_ii[3]]), (
        orbit.error
    )


def _first_order(scene: Scene) -> Answer | None:
    """Return the responses of the stable motion of smallest amplitude: the motion reached from rest."""
    spring = spring_of(scene.specimen)
    if not isinstance(spring, PowerSpring):
        return None
    drive = scene.drive
    states = first_order_states(structure_of(scene.specimen), spring, drive.frequency_hz, drive.amplitude_m)
    stable = [each for each in states if each.is_stable_to_amplitude]
    if not stable:
        return None
    x, p = abs(stable[0].displacements[0]), abs(stable[0].relative)
    return np.array([x, x, p, p]) / drive.amplitude_m, None


def _balance(scene: Scene, tolerance: float) -> Answer | None:
    spring, drive = spring_of(scene.specimen), scene.drive
    kept = HarmonicSet.ODD if spring.is_odd else HarmonicSet.ALL
    options = BalanceOptions(kept, tolerance=tolerance)
    found = balance(structure_of(scene.specimen), spring, drive.frequency_hz, drive.amplitude_m, options)
    if found.outcome is not BalanceEnd.CONVERGED:
        return None
    first, lines = found.response_i, found.response_ii
    return np.array([first[0], lines[0], first[-1], lines[-1]]), None


def _responses(found: ScenePrediction) -> Floats:
    values = (found.response_i, found.response_ii, found.relative_i, found.relative_ii)
    return np.array(values, dtype=np.float64)


def _pair(found: ScenePrediction) -> tuple[float, float]:
    responses = _responses(found)
    return float(responses[0]), float(responses[1])
