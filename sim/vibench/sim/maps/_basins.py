"""Analysis of basins of attraction: fractal dimension of the boundaries, and stability under kicks."""

import math
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

from ..engine.run import Outcome, refuse_inside_a_stop
from ..scene.prediction import MotionKind, ScenePrediction
from ..scene.scene import Given, Scene
from ..scene.shares import Share, wilson_share
from ..scene.solve import settle_scene
from ..specimen.specimen import Floats, state_scales
from ..study import InvalidStudy
from ._expansion import BASIN_JUMP
from ._results import MapMotion, MapResults

BLOCKS = 4
"""Number of parts into which each axis is divided for the jackknife error of the exponent."""
FEWEST_SIZES = 3
FEWEST_UNCERTAIN = 100
"""Smallest number of uncertain initial states at each distance that the fit uses."""
MOST_UNCERTAIN = 0.5
"""Largest share of uncertain initial states at each distance that the fit uses."""
MOST_DRAWS = 100
"""Largest number of draws for each kick that does not move m1 beyond a rigid stop."""
SPREAD = 4.0
"""Smallest ratio of the largest to the smallest distance of a fit; below this, the slope is unreliable."""


@dataclass(frozen=True)
class UncertaintyExponent:
    """Exponent of basin boundaries: the share of uncertain initial states varies as distance^exponent.

    It is 1 for a smooth boundary, and 0 if a more accurate initial state does not improve the prediction. The
    dimension of the boundary is 2 - exponent (McDonald, Grebogi, Ott and Yorke, Physica D 17 (1985) 125).
    """

    exponent: float
    low: float
    """Lower 95 % confidence limit of the exponent, for the boundary as the grid resolves it."""
    high: float
    steps: tuple[int, ...]
    """Distances between initial states that the fit uses, in grid steps."""
    shares: tuple[float, ...]
    """Share of uncertain initial states at each distance of the fit."""


def uncertainty_exponent(numbers: NDArray[np.int64]) -> UncertaintyExponent | None:
    """Return the uncertainty exponent of the basin boundaries in a map over two initial coordinates.

    An initial state is uncertain at a distance if a step of this size along an axis leads to another motion.
    The confidence interval is a jackknife estimate over parts of the map. Returns None unless, at three or
    more distances, at least 100 and at most half of the initial states are uncertain.

    Parameters
    ----------
    numbers
        Index of the motion from each initial state, `MapResults.motion_numbers[:, 0]`, shape (rows, columns).
    """
    steps = [2**k for k in range(int(math.log2(max(min(numbers.shape) // 8, 1))) + 1)]
    uncertain = {step: _is_uncertain(numbers, step, steps[-1]) for step in steps}
    kept = [
        step
        for step, is_it in uncertain.items()
        if is_it.sum() >= FEWEST_UNCERTAIN and is_it.mean() <= MOST_UNCERTAIN
    ]
    if len(kept) < FEWEST_SIZES or kept[-1] < SPREAD * kept[0]:
        return None
    slopes = np.array(
        [_slope(kept, [_share_without(uncertain[step], part) for step in kept]) for part in range(BLOCKS**2)]
    )
    whole = [float(uncertain[step].mean()) for step in kept]
    exponent = _slope(kept, whole)
    count = len(slopes)
    deviation = math.sqrt((count - 1) / count * float(((slopes - slopes.mean()) ** 2).sum()))
    half = float(stdtrit(count - 1, 0.975)) * deviation
    return UncertaintyExponent(exponent, exponent - half, exponent + half, tuple(kept), tuple(whole))


def _is_uncertain(numbers: NDArray[np.int64], step: int, edge: int) -> NDArray[np.bool_]:
    """Return whether a step of this length along an axis leads to another motion, for all inner cells."""
    inner = numbers[
        edge - step : numbers.shape[0] - edge + step, edge - step : numbers.shape[1] - edge + step
    ]
    within, twice = slice(step, -step), 2 * step
    here = inner[within, within]
    beside = inner[:-twice, within], inner[twice:, within], inner[within, :-twice], inner[within, twice:]
    return np.asarray(np.any([each != here for each in beside], axis=0))


def _share_without(uncertain: NDArray[np.bool_], part: int) -> float:
    """Return the share of uncertain initial states, with one part of the map left out."""
    rows, columns = (np.arange(length) * BLOCKS // length for length in uncertain.shape)
    is_in = (rows[:, None] * BLOCKS + columns) != part
    return max(float(uncertain[is_in].mean()), 1.0 / uncertain.size)


def _slope(steps: Sequence[int], shares: Sequence[float]) -> float:
    return float(np.polyfit(np.log(steps), np.log(shares), 1)[0])


@dataclass(frozen=True)
class KickStability:
    """Stability of a motion under random kicks of all displacements and velocities."""

    motion: int
    """Index of the motion, as in `MapResults.motion_numbers`."""
    size: float
    """Standard deviation of the kicks: displacements / gap, velocities / (gap * 2 pi f)."""
    returned: Share
    """Share of kicks after which the motion returns within the map's number of drive periods."""


def kick_stability(
    results: MapResults,
    sizes: Sequence[float] = (0.01, 0.1, 1.0),
    kicks: int = 100,
    seed: int = 1,
    workers: int | None = None,
) -> tuple[KickStability, ...]:
    """Return how often each motion of a basin map returns after random kicks (basin stability).

    Raises InvalidStudy when drive or specimen vary in the map, when the specimen is undamped, or when the
    number of kicks is below 1. A kick that moves m1 beyond a rigid stop is drawn again.

    Parameters
    ----------
    results
        Complete map in which only the start varies.
    sizes
        Standard deviations of the kicks, which are normally distributed. Menck, Heitzig, Marwan and Kurths,
        Nature Physics 9 (2013) 89, distribute kicks uniformly in a box.
    kicks
        Number of kicks of each size, all at the same drive phase.
    seed, workers
        Seed of the random kicks, and number of threads.
    """
    if kicks < 1:
        raise InvalidStudy(f"{kicks} kicks were requested; give 1 or more.")
    results.plan.require_kicks_allowed()
    found = []
    with ThreadPoolExecutor(workers) as pool:
        for number, motion in enumerate(results.motions):
            point = results.example(number)
            for size in sizes:
                scenes = _kick_scenes(results, point, size, kicks, seed)
                back = sum(_is_same(motion, each) for each in pool.map(settle_scene, scenes))
                found.append(KickStability(number, size, wilson_share(back, kicks)))
    return tuple(found)


def _kick_scenes(results: MapResults, point: int, size: float, kicks: int, seed: int) -> list[Scene]:
    scene = results.plan.scene(results.plan.grid.place(point))
    scene = replace(
        scene, drive=replace(scene.drive, phase_rad=results.plan.phase_after(point, results.arrays))
    )
    state: Floats = results.arrays["final_state"][point].astype(np.float64)
    rng = np.random.default_rng([seed, point])
    scale = size * state_scales(scene.specimen, scene.drive)
    kicked: list[Scene] = []
    for _ in range(MOST_DRAWS * kicks):
        x, y, z, vx, vy, vz = (state + scale * rng.standard_normal(6)).tolist()
        start = Given((x, y, z, vx, vy, vz), "kicked")
        with suppress(ValueError):
            refuse_inside_a_stop(np.array(start.state), scene.specimen)
            kicked.append(replace(scene, start=start))
        if len(kicked) == kicks:
            return kicked
    raise InvalidStudy(f"kicks of {size:g} gaps move m1 beyond the rigid stops; give smaller kicks.")


def _is_same(motion: MapMotion, found: ScenePrediction) -> bool:
    if found.outcome is not Outcome.REACHED_END or found.motion is not motion.motion:
        return False
    if motion.motion is not MotionKind.PERIODIC:
        return True
    near = abs((found.response_i or 0.0) / motion.response_i - 1.0) < BASIN_JUMP
    return near and found.period == motion.period
