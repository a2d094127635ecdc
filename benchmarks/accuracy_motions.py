"""Measure cost and error of every accuracy level on known motions, for docs/accuracy.md.

There is one motion of each kind, named by contact law and drive. Runs of the levels alternate, so that a busy
machine slows all alike. Cost is processor time over simulated time. Errors are against
`independent_solution`, which shares no code with the engine. `accuracy_page.py` writes docs/accuracy.md from
the results. SI units.
"""

import math
import os
import platform
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from enum import StrEnum
from itertools import pairwise
from pathlib import Path

import numpy as np
from independent_solution import (
    STATE_UNITS,
    independent_state,
    state_error,
)
from stroboscopic_section import stroboscopic_section

from vibench.sim.engine.run import Accuracy
from vibench.sim.exponents.lyapunov import lyapunov_exponent
from vibench.sim.motion.integrate import integrate
from vibench.sim.motion.response import steady_response
from vibench.sim.periodic.shooting import flow_derivative, smallest_period
from vibench.sim.scene.prediction import Ensemble, FoundMotion, MotionKind, ScenePrediction
from vibench.sim.scene.scene import AutomaticDuration, FixedDuration, Scene
from vibench.sim.scene.solve import solve_ensemble, solve_scene
from vibench.sim.specimen.drive import Harmonic
from vibench.sim.specimen.specimen import Floats, Specimen, gong2025, state_scales
from vibench.sim.study import software

SEED = 4242
"""Seed of the initial states for comparison; a prediction draws its initial states with another seed."""
PENDING = (MotionKind.CHAOTIC, MotionKind.CHAOTIC_SO_FAR, MotionKind.UNDECIDED)
"""Kinds that count as equal, because they depend on how long a motion was followed."""
SAME = 1e-3
"""Largest relative difference of Response I of equal periodic motions; predictions use the same limit."""


@dataclass(frozen=True)
class Lottery:
    """A scene (specimen and drive) in which chance decides which motion is reached, or when."""

    about: str
    model: str
    frequency_hz: float
    amplitude_m: float
    gap_m: float | tuple[float, float] = 45e-6
    damping_time_s: float = 2e-5

    @property
    def scene(self) -> Scene:
        """The scene, followed until it settles."""
        specimen = gong2025(self.damping_time_s, self.gap_m, self.model)
        return Scene(specimen, Harmonic(self.frequency_hz, self.amplitude_m), duration=AutomaticDuration())

    @property
    def name(self) -> str:
        """Name of the scene in tables."""
        return f"{self.model}, {self.frequency_hz:g} Hz, {1e6 * self.amplitude_m:g} µm"


LOTTERIES = (
    Lottery("chaos that lasts", "hertz", 260.0, 5e-6),
    Lottery("chaos that dies out", "hertz", 242.0, 5e-6, damping_time_s=3e-5),
    Lottery("chaos that soon dies out", "linear_gap", 562.8, 20e-6),
    Lottery("several motions, gaps of 289 and 98 µm", "hertz", 475.2, 154.1e-6, (289e-6, 98e-6)),
)


@dataclass(frozen=True)
class StatedShare:
    """A motion with its stated share of initial states, and its share among many more initial states."""

    motion: FoundMotion
    of_many: float

    @property
    def is_covered(self) -> bool:
        """Whether the stated interval contains the share among many initial states."""
        return self.motion.share.low <= self.of_many <= self.motion.share.high


@dataclass(frozen=True)
class LotteryFigures:
    """Results for one scene."""

    lottery: Lottery
    prediction: ScenePrediction
    shares: tuple[StatedShare, ...]
    starts: int
    """Number of initial states for the comparison."""
    cost: float
    """Processor time of the prediction, over that without a budget for other initial states."""


def measure_attractors(lottery: Lottery, starts: int) -> LotteryFigures:
    """Predict a scene, and compare the stated shares with those of many more initial states.

    Raises ArithmeticError when the motion does not depend sensitively on the initial state.
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
    return sum(each.share.share for each in many.motions if is_same_motion(each, motion))


def is_same_motion(one: FoundMotion, other: FoundMotion) -> bool:
    """Return whether two motions are equal; all that may not be settled yet count as equal."""
    if one.motion in PENDING or other.motion in PENDING:
        return one.motion in PENDING and other.motion in PENDING
    is_near = abs((one.response_i or 0.0) / (other.response_i or 1.0) - 1.0) < SAME
    return one.period == other.period and is_near


def _time_run(run: Callable[[], ScenePrediction]) -> tuple[float, ScenePrediction]:
    before = time.thread_time()
    found = run()
    return time.thread_time() - before, found


class Regime(StrEnum):
    """Kind of motion; it decides what a higher accuracy improves."""

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
        """The paper's specimen with the contact law of this model."""
        return gong2025(contact=self.model)

    @property
    def drive(self) -> Harmonic:
        """U = A0 sin(omega t)."""
        return Harmonic(self.frequency_hz, self.amplitude_m)

    @property
    def name(self) -> str:
        """Name of the motion in tables."""
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
"""Motions whose kind was found by a scan; `settled_state` checks the kind."""
TRANSIENTS = tuple(
    Motion(Regime.TRANSIENT, model, 130.0, 20e-6)
    for model in ("hertz", "linear_gap", "power:7", "power:47", "power:201")
)
"""Motions observed from rest, while a small change grows a thousandfold."""
LEAST_GAIN = 2.0
"""Factor by which the error must fall for a level to count as better than the level before."""


@dataclass(frozen=True)
class LevelFigures:
    """Figures of one accuracy level on one motion."""

    accuracy: Accuracy
    cost: float
    """Processor time over simulated time."""
    state_error: float | None
    """Error of the state at the end of the span, from `state_error`; None in chaos."""
    response_i_error: float | None
    """Relative error against the reference level; None in chaos."""
    response_ii_error: float | None
    response_i: float
    """Response I; in chaos, the mean over all initial states."""
    response_i_scatter: float
    """Relative standard deviation of Response I over the initial states in chaos; 0 otherwise."""
    exponent_per_s: float
    exponent_error_per_s: float
    """Statistical standard error of the exponent, which no accuracy level reduces."""


@dataclass(frozen=True)
class MotionBenchmark:
    """Cost and error of all levels on one motion."""

    motion: Motion
    span_s: float
    levels: tuple[LevelFigures, ...]

    @property
    def advice(self) -> str:
        """Sentence that recommends a level."""
        match self.motion.regime:
            case Regime.FREE:
                return "Without contact, the solution has a closed form, so all levels agree."
            case Regime.PERIODIC | Regime.TRANSIENT:
                return self._periodic_advice()
            case Regime.CHAOTIC:
                return (
                    "`quick` is sufficient: no stricter level reduces the scatter of Response I between "
                    f"initial conditions ({self.levels[0].response_i_scatter:.1%} at `quick`)."
                )

    @property
    def without_gain(self) -> tuple[tuple[LevelFigures, LevelFigures], ...]:
        """Pairs of a level and the level before it, if the later level is no better."""
        return tuple(
            (level, before)
            for before, level in pairwise(self.levels)
            if self.motion.regime is Regime.PERIODIC and not _is_better(level, before)
        )

    def _periodic_advice(self) -> str:
        quick, _, reference = self.levels
        price = f"`reference` takes {reference.cost / quick.cost:.1f} times as long as `quick`"
        match [level.accuracy for level, _ in self.without_gain]:
            case []:
                return f"Each level reduces the state error; {price}."
            case [Accuracy.STANDARD]:
                return f"Only `reference` reduces the state error; {price}."
            case [Accuracy.REFERENCE]:
                return f"`standard` reduces the state error, `reference` does not; {price}."
            case _:
                return f"All levels are about equally accurate; {price}."


def _is_better(level: LevelFigures, before: LevelFigures) -> bool:
    if level.state_error is None or before.state_error is None:
        return False
    return LEAST_GAIN * level.state_error < before.state_error


@dataclass(frozen=True)
class TransientFigures:
    """Figures of one accuracy level on a transient motion."""

    motion: Motion
    accuracy: Accuracy
    growth: float
    """Largest factor by which a small change of the state grows, from the start or to the end."""
    state_error: float
    """Error of the state at the end, from `state_error`."""
    response_error: float
    """Largest relative error of the four responses, against the reference level."""
    stated_error: float
    """Error of the responses that the prediction states."""

    @property
    def promise(self) -> float:
        """Promised error: that of the level for a settled motion, times the growth of a small change."""
        return self.accuracy.promise * max(1.0, self.growth)


@dataclass(frozen=True)
class AccuracyBenchmark:
    """All results of one run of this benchmark."""

    motions: tuple[MotionBenchmark, ...]
    machine: str
    """Processor and number of cores."""
    software: str
    lotteries: tuple[LotteryFigures, ...] = ()
    transients: tuple[TransientFigures, ...] = ()

    def worst_error(self, accuracy: Accuracy) -> float:
        """Return the largest error of the state of a level over all motions without chaos."""
        levels = [level for each in self.motions for level in each.levels if level.accuracy is accuracy]
        return max((each.state_error for each in levels if each.state_error is not None), default=0.0)


LEVELS = tuple(Accuracy)
SETTLE_S = 8.0
"""Settling time [s]: thirty times the slowest decay time of the specimen without contact."""
PERIODS_SEEN = 100
REPEATS = 3
TIMED_S = 10.0
RESPONSE_S, WINDOW_S = 3.0, 2.0
STARTS = 8
EXPONENT_S = 10.0
TRANSIENT_S = 0.1
LOOKS = 20
"""Number of instants between which the growth of a small change is computed."""
RESPONSES = ("response_i", "response_ii", "relative_i", "relative_ii")
START_SPREAD_M = 1e-6

Step = Callable[[str], None]
"""Function that is called with the name of each motion before it is measured."""


@dataclass(frozen=True)
class Thoroughness:
    """Lengths of the compared motions; longer ones take more time and test more."""

    span_s: float = 0.5
    """Time span of the comparison with the independent solution [s]."""
    starts: int = 200
    """Number of initial states for comparison, of a scene with sensitive dependence on them."""


def measure_accuracy(
    thoroughness: Thoroughness = Thoroughness(),
    step: Step = lambda _: None,
    motions: tuple[Motion, ...] = MOTIONS,
    lotteries: tuple[Lottery, ...] = LOTTERIES,
    transients: tuple[Motion, ...] = TRANSIENTS,
) -> AccuracyBenchmark:
    """Measure cost and error on every motion.

    Raises
    ------
    ArithmeticError
        When a motion is not of the stated kind, or the independent solution fails.
    """
    found: list[MotionBenchmark] = []
    for motion in motions:
        step(motion.name)
        found.append(measure_motion(motion, thoroughness))
    drawn = []
    for lottery in lotteries:
        step(lottery.name)
        drawn.append(measure_attractors(lottery, thoroughness.starts))
    from_rest: list[TransientFigures] = []
    for motion in transients:
        step(f"from rest: {motion.name}")
        from_rest += measure_transient(motion)
    return AccuracyBenchmark(tuple(found), _machine(), software(), tuple(drawn), tuple(from_rest))


def measure_motion(motion: Motion, thoroughness: Thoroughness) -> MotionBenchmark:
    """Measure cost and error of all levels on one motion, from its settled state."""
    start = settled_state(motion)
    span_s = _whole(thoroughness.span_s, motion)
    truth = None if motion.regime is Regime.CHAOTIC else _truth(motion, span_s, start)
    costs = _costs(motion, start)
    responses = {level: _responses(motion, level, start) for level in LEVELS}
    levels = tuple(_level(motion, level, costs[level], responses, start, span_s, truth) for level in LEVELS)
    return MotionBenchmark(motion, span_s, levels)


def measure_transient(motion: Motion) -> tuple[TransientFigures, ...]:
    """Measure the error of every level on a motion from rest, and the error that the prediction states."""
    rest = np.zeros(6)
    truth = independent_state(motion.specimen, motion.drive, TRANSIENT_S, rest)
    duration = FixedDuration(TRANSIENT_S, 0.5 * TRANSIENT_S)
    found = {
        level: solve_scene(Scene(motion.specimen, motion.drive, accuracy=level, duration=duration))
        for level in LEVELS
    }
    seen = {level: np.array([getattr(each, name) for name in RESPONSES]) for level, each in found.items()}
    growth = _growth(motion)
    return tuple(
        TransientFigures(
            motion,
            level,
            growth,
            state_error(_follow(motion, level, rest, TRANSIENT_S), truth),
            float(np.max(np.abs(seen[level] / seen[Accuracy.REFERENCE] - 1.0))),
            found[level].error_estimate or math.nan,
        )
        for level in LEVELS
    )


def _growth(motion: Motion) -> float:
    """Return the largest growth of a change of the state, from the start or to the end."""
    ends = TRANSIENT_S * np.arange(1.0, LOOKS + 1.0) / LOOKS
    derivatives = [np.eye(6)] + [
        flow_derivative(motion.specimen, motion.drive, np.zeros(6), float(end_s))[1] for end_s in ends
    ]
    scale = STATE_UNITS / STATE_UNITS[:, None]
    onto_end = [derivatives[-1] @ np.linalg.inv(each) for each in derivatives[:-1]]
    return max(float(np.linalg.norm(each * scale, 2)) for each in (*derivatives, *onto_end))


def settled_state(motion: Motion) -> Floats:
    """Return the settled state at phase zero of the drive, shape (6,)."""
    periods = math.ceil(SETTLE_S * motion.frequency_hz)
    section = stroboscopic_section(motion.specimen, motion.drive, periods, Accuracy.REFERENCE)
    period = smallest_period(section[-PERIODS_SEEN:], state_scales(motion.specimen, motion.drive))
    if (period is None) != (motion.regime is Regime.CHAOTIC):
        raise ArithmeticError(f"{motion.name} is called {motion.regime.value}, but its period is {period}")
    return np.asarray(section[-1])


def _whole(span_s: float, motion: Motion) -> float:
    return max(1, round(span_s * motion.frequency_hz)) / motion.frequency_hz


def _truth(motion: Motion, span_s: float, start: Floats) -> Floats:
    return independent_state(motion.specimen, motion.drive, span_s, start)


def _run_time_s(run: Callable[[], object]) -> float:
    before = time.thread_time()
    run()
    return time.thread_time() - before


def _costs(motion: Motion, start: Floats) -> dict[Accuracy, float]:
    """Return the shortest processor time over simulated time of each level, without the first round."""
    best = dict.fromkeys(LEVELS, math.inf)
    for repeat in range(REPEATS + 1):
        for level in LEVELS:
            taken = _run_time_s(lambda level=level: _follow(motion, level, start, TIMED_S))  # type: ignore[misc]
            if repeat > 0:
                best[level] = min(best[level], taken / TIMED_S)
    return best


def _follow(motion: Motion, level: Accuracy, start: Floats, span_s: float) -> Floats:
    return integrate(motion.specimen, motion.drive, span_s, level, start).final_state


def _responses(motion: Motion, level: Accuracy, start: Floats) -> Floats:
    """Return Responses I and II from one initial state, in chaos from several; shape (states, 2)."""
    rng = np.random.default_rng(1)
    starts = STARTS if motion.regime is Regime.CHAOTIC else 1
    found = []
    for number in range(starts):
        moved = start.copy()
        if number > 0:
            moved[:3] += START_SPREAD_M * rng.standard_normal(3)
        seen = steady_response(motion.specimen, motion.drive, level, RESPONSE_S, WINDOW_S, moved)
        found.append((seen.response_i, seen.response_ii))
    return np.array(found)


def _level(
    motion: Motion,
    level: Accuracy,
    cost: float,
    responses: dict[Accuracy, Floats],
    start: Floats,
    span_s: float,
    truth: Floats | None,
) -> LevelFigures:
    mean, exact = responses[level].mean(axis=0), responses[Accuracy.REFERENCE].mean(axis=0)
    off = np.abs(mean / exact - 1.0)
    exponent = lyapunov_exponent(motion.specimen, motion.drive, level, EXPONENT_S, 0.5, start)
    is_chaotic = truth is None
    return LevelFigures(
        accuracy=level,
        cost=cost,
        state_error=None if truth is None else state_error(_follow(motion, level, start, span_s), truth),
        response_i_error=None if is_chaotic else float(off[0]),
        response_ii_error=None if is_chaotic else float(off[1]),
        response_i=float(mean[0]),
        response_i_scatter=float(np.std(responses[level][:, 0], ddof=1) / mean[0]) if is_chaotic else 0.0,
        exponent_per_s=exponent.exponent_per_s,
        exponent_error_per_s=exponent.standard_error_per_s,
    )


def _machine() -> str:
    return f"{next(_processor_names(), platform.machine())}, {os.cpu_count()} cores"


def _processor_names() -> Iterator[str]:
    described = Path("/proc/cpuinfo")
    if described.exists():
        for line in described.read_text(encoding="utf-8").splitlines():
            key, _, value = line.partition(":")
            if key.strip() == "model name":
                yield value.strip()
