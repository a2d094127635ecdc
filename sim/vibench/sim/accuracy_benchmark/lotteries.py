"""Scenes whose start is forgotten: what an answer states of them, beside what many more starts come to."""

import time
from collections.abc import Callable
from dataclasses import dataclass, replace

from ..model.drive import Harmonic
from ..model.specimen import gong2025
from ..scene.prediction import Ensemble, FoundMotion, MotionKind, ScenePrediction
from ..scene.scene import AutomaticDuration, Scene
from ..scene.solve import solve_ensemble, solve_scene

SEED = 4242
"""Another draw of starts than an answer's own."""
PENDING = (MotionKind.CHAOTIC, MotionKind.CHAOTIC_SO_FAR, MotionKind.UNDECIDED)
"""Which of these a start is called depends on how long it was followed."""
SAME = 1e-3
"""Relative difference of Response I of one motion that repeats, as an answer tells motions apart."""


@dataclass(frozen=True)
class Lottery:
    """A scene in which it is chance which motion is reached, or when."""

    about: str
    model: str
    frequency_hz: float
    amplitude_m: float
    gap_m: float | tuple[float, float] = 45e-6
    damping_time_s: float = 2e-5

    @property
    def scene(self) -> Scene:
        """As it is asked."""
        specimen = gong2025(self.damping_time_s, self.gap_m, self.model)
        return Scene(specimen, Harmonic(self.frequency_hz, self.amplitude_m), duration=AutomaticDuration())

    @property
    def name(self) -> str:
        """How tables call it."""
        return f"{self.model}, {self.frequency_hz:g} Hz, {1e6 * self.amplitude_m:g} µm"


LOTTERIES = (
    Lottery("chaos that lasts", "hertz", 260.0, 5e-6),
    Lottery("chaos that dies out", "hertz", 242.0, 5e-6, damping_time_s=3e-5),
    Lottery("chaos that soon dies out", "linear_gap", 562.8, 20e-6),
    Lottery("several motions, gaps of 289 and 98 µm", "hertz", 475.2, 154.1e-6, (289e-6, 98e-6)),
)


@dataclass(frozen=True)
class StatedShare:
    """A motion, its share as an answer states it, and the share of many starts."""

    motion: FoundMotion
    of_many: float

    @property
    def is_covered(self) -> bool:
        """The interval that is stated holds the share of the many."""
        return self.motion.share.low <= self.of_many <= self.motion.share.high


@dataclass(frozen=True)
class LotteryFigures:
    """What was found of one scene."""

    lottery: Lottery
    answered: ScenePrediction
    shares: tuple[StatedShare, ...]
    starts: int
    """The many."""
    cost: float
    """Of the answer over that of one without a budget."""


def measured_lottery(lottery: Lottery, starts: int) -> LotteryFigures:
    """Answer a scene, and follow many more starts of it.

    Raises ArithmeticError when its start is not forgotten.
    """
    scene = lottery.scene
    solve_scene(replace(scene, budget_s=0.0))
    alone_s, _ = _timed(lambda: solve_scene(replace(scene, budget_s=0.0)))
    taken_s, answered = _timed(lambda: solve_scene(scene))
    many = solve_ensemble(scene, starts, SEED)
    if answered.ensemble is None or many is None:
        raise ArithmeticError(f"{lottery.name} is called a lottery, but its start is {answered.memory}")
    shares = tuple(StatedShare(each, _share_in(many, each)) for each in answered.ensemble.motions)
    return LotteryFigures(lottery, answered, shares, many.starts, taken_s / alone_s)


def _share_in(many: Ensemble, motion: FoundMotion) -> float:
    return sum(each.share.share for each in many.motions if _is_same(each, motion))


def _is_same(one: FoundMotion, other: FoundMotion) -> bool:
    if one.motion in PENDING or other.motion in PENDING:
        return one.motion in PENDING and other.motion in PENDING
    is_near = abs((one.response_i or 0.0) / (other.response_i or 1.0) - 1.0) < SAME
    return one.period == other.period and is_near


def _timed(run: Callable[[], ScenePrediction]) -> tuple[float, ScenePrediction]:
    before = time.thread_time()
    found = run()
    return time.thread_time() - before, found
