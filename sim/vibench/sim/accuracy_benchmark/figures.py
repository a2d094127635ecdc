"""What the accuracy benchmark says: cost and error of each level, and of general solvers beside them.

The motions on which the trade is measured: one of each kind, named by how it is driven.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import StrEnum
from itertools import pairwise

from ..scene.prediction import Ensemble, FoundMotion, MotionKind, ScenePrediction
from ..scene.scene import AutomaticDuration, Scene
from ..scene.solve import solve_ensemble, solve_scene
from ..specimen.accuracy import Accuracy
from ..specimen.drive import Harmonic
from ..specimen.specimen import Specimen, gong2025

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
    """Cost of the answer over that of one without a budget."""


def measure_attractors(lottery: Lottery, starts: int) -> LotteryFigures:
    """Answer a scene, and follow many more starts of it.

    Raises ArithmeticError when its start is not forgotten.
    """
    scene = lottery.scene
    solve_scene(replace(scene, budget_s=0.0))
    alone_s, _ = _time_run(lambda: solve_scene(replace(scene, budget_s=0.0)))
    taken_s, answered = _time_run(lambda: solve_scene(scene))
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


def _time_run(run: Callable[[], ScenePrediction]) -> tuple[float, ScenePrediction]:
    before = time.thread_time()
    found = run()
    return time.thread_time() - before, found


class Regime(StrEnum):
    """What a motion is like; what accuracy buys depends on it."""

    FREE = "no contact"
    PERIODIC = "periodic"
    CHAOTIC = "chaos"
    TRANSIENT = "from rest"


@dataclass(frozen=True)
class Motion:
    """One motion of one model."""

    regime: Regime
    model: str
    """Name of the contact law in `vibench.sim.specimen`."""
    frequency_hz: float
    amplitude_m: float

    @property
    def specimen(self) -> Specimen:
        """The paper's, with this model's contact."""
        return gong2025(contact=self.model)

    @property
    def drive(self) -> Harmonic:
        """U = A0 sin(omega t)."""
        return Harmonic(self.frequency_hz, self.amplitude_m)

    @property
    def name(self) -> str:
        """How tables call it."""
        return f"{self.model}, {self.frequency_hz:g} Hz, {1e6 * self.amplitude_m:g} µm"


MOTIONS = (
    Motion(Regime.FREE, "hertz", 260.0, 1e-6),
    Motion(Regime.PERIODIC, "hertz", 130.0, 20e-6),
    Motion(Regime.PERIODIC, "linear_gap", 130.0, 20e-6),
    Motion(Regime.PERIODIC, "power:3", 150.0, 10e-6),
    Motion(Regime.PERIODIC, "power:7", 100.0, 5e-6),
    Motion(Regime.PERIODIC, "power:47", 100.0, 5e-6),
    Motion(Regime.CHAOTIC, "hertz", 260.0, 5e-6),
)
"""Kinds were found by scanning; `vibench.sim.accuracy_benchmark` refuses a periodic motion that is none."""
TRANSIENTS = tuple(
    Motion(Regime.TRANSIENT, model, 130.0, 20e-6)
    for model in ("hertz", "linear_gap", "power:7", "power:47", "power:201")
)
"""Followed from rest, while a small change grows a thousandfold."""
LEAST_GAIN = 2.0
"""A level whose error is not smaller than the one before it by this factor buys nothing."""


@dataclass(frozen=True)
class LevelFigures:
    """One level of accuracy on one motion."""

    accuracy: Accuracy
    cost: float
    """Processor time over simulated time."""
    state_error: float | None
    """State error of the state at the end of the span, as `state_error` measures it; None in chaos."""
    response_i_error: float | None
    """Relative, against the reference level; None in chaos."""
    response_ii_error: float | None
    response_i: float
    """Mean over all starts in chaos."""
    response_i_scatter: float
    """Relative standard deviation of Response I over starts; 0 where all agree."""
    exponent_per_s: float
    exponent_error_per_s: float
    """Standard error of the exponent itself, whatever the accuracy."""


@dataclass(frozen=True)
class SolverFigures:
    """A general solver on one motion."""

    name: str
    cost: float
    """Processor time over simulated time."""
    state_error: float | None
    """Over its own, shorter span, against the independent solution."""


@dataclass(frozen=True)
class MotionBenchmark:
    """The trade on one motion."""

    motion: Motion
    span_s: float
    solver_span_s: float
    levels: tuple[LevelFigures, ...]
    solvers: tuple[SolverFigures, ...]

    @property
    def advice(self) -> str:
        """Say in a sentence which level to take."""
        match self.motion.regime:
            case Regime.FREE:
                return "Flight is exact: all levels are the same."
            case Regime.PERIODIC | Regime.TRANSIENT:
                return self._periodic_advice()
            case Regime.CHAOTIC:
                return (
                    "Quick is as good as any: with the start of the motion Response I scatters by "
                    f"{self.levels[0].response_i_scatter:.1%}, which no accuracy lessens."
                )

    @property
    def without_gain(self) -> tuple[tuple[LevelFigures, LevelFigures], ...]:
        """Levels whose state is no better than that of the level before, each with that one."""
        return tuple(
            (level, before)
            for before, level in pairwise(self.levels)
            if self.motion.regime is Regime.PERIODIC and not _is_better(level, before)
        )

    def _periodic_advice(self) -> str:
        quick, standard, reference = self.levels
        steps = f"{quick.state_error:.0e}, {standard.state_error:.0e} and {reference.state_error:.0e}"
        errors = f"{steps} of the state"
        price = f"costs {reference.cost / quick.cost:.1f} times the first"
        match [level.accuracy for level, _ in self.without_gain]:
            case []:
                return f"Each level buys digits: {errors}; the last {price}."
            case [Accuracy.STANDARD]:
                return f"Standard is no better than quick, reference is: {errors}; the last {price}."
            case [Accuracy.REFERENCE]:
                return f"Standard buys digits, reference no more: {errors}; the last {price}."
            case _:
                return f"No level buys digits: {errors}; the last {price}."


def _is_better(level: LevelFigures, before: LevelFigures) -> bool:
    if level.state_error is None or before.state_error is None:
        return False
    return LEAST_GAIN * level.state_error < before.state_error


@dataclass(frozen=True)
class TransientFigures:
    """One level of accuracy on a motion that has forgotten nothing yet."""

    motion: Motion
    accuracy: Accuracy
    growth: float
    """Largest factor by which a small change of the state grows on the way, up to the end."""
    state_error: float
    """At the end, as `state_error` measures it."""
    response_error: float
    """Relative, the largest of the four responses, against the reference level."""
    stated_error: float
    """What the answer says of them."""

    @property
    def promise(self) -> float:
        """What the level promises here: its error of a settled motion, as often as a small change grows."""
        return self.accuracy.promise * max(1.0, self.growth)


@dataclass(frozen=True)
class AccuracyBenchmark:
    """Everything that was measured in one run."""

    motions: tuple[MotionBenchmark, ...]
    machine: str
    """Processor and cores."""
    software: str
    lotteries: tuple[LotteryFigures, ...] = ()
    transients: tuple[TransientFigures, ...] = ()

    def worst_error(self, accuracy: Accuracy) -> float:
        """Return the largest error of the state that a level made on any motion that is not chaotic."""
        levels = [level for each in self.motions for level in each.levels if level.accuracy is accuracy]
        return max((each.state_error for each in levels if each.state_error is not None), default=0.0)
