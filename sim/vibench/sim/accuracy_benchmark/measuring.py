"""Measure cost and error of every level on a motion, interleaved, so that a busy machine slows all alike."""

import math
import os
import platform
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from scipy.integrate import solve_ivp

from ..exponents.lyapunov import lyapunov_exponent
from ..motion.integrate import integrate
from ..motion.poincare import flow_derivative, smallest_period, stroboscopic_section
from ..motion.response import steady_response
from ..scene.scene import FixedDuration, Scene
from ..scene.solve import solve_scene
from ..specimen.accuracy import Accuracy
from ..specimen.specimen import state_scales
from ..specimen.state import Floats
from ..study import software
from .figures import (
    LOTTERIES,
    MOTIONS,
    TRANSIENTS,
    AccuracyBenchmark,
    LevelFigures,
    Lottery,
    Motion,
    MotionBenchmark,
    Regime,
    SolverFigures,
    TransientFigures,
    measure_attractors,
)
from .independent_solution import (
    STATE_UNITS,
    Place,
    independent_state,
    law_of,
    numbers_of,
    rates_at,
    state_error,
)

LEVELS = tuple(Accuracy)
Solver = Literal["DOP853", "LSODA", "Radau"]
SOLVERS: tuple[Solver, ...] = ("DOP853", "LSODA", "Radau")
SOLVER_RTOL, SOLVER_ATOL = 1e-6, 1e-12
SETTLE_S = 8.0
"""Thirty times the slowest decay of the specimen without contact."""
PERIODS_SEEN = 100
REPEATS = 3
TIMED_S = 10.0
RESPONSE_S, WINDOW_S = 3.0, 2.0
STARTS = 8
EXPONENT_S = 10.0
TRANSIENT_S = 0.1
LOOKS = 20
"""Instants up to which, and from which on, the growth of a small change is taken."""
RESPONSES = ("response_i", "response_ii", "relative_i", "relative_ii")
START_SPREAD_M = 1e-6

Step = Callable[[str], None]
"""Told, in a few words, what is being measured."""


@dataclass(frozen=True)
class Thoroughness:
    """How long the compared motions are: longer ones cost more and prove more."""

    span_s: float = 0.5
    """Span of the comparison with the independent solution."""
    solver_span_s: float = 0.05
    """Solver span of general solvers, which are slow."""
    starts: int = 200
    """Followed of a scene whose start is forgotten."""


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
        When a motion is not of the kind it is called, or the independent solution gives up.
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
    """Measure the trade on one motion, from its settled state."""
    start = settled_state(motion)
    span_s = _whole(thoroughness.span_s, motion)
    solver_span_s = _whole(thoroughness.solver_span_s, motion)
    is_chaotic = motion.regime is Regime.CHAOTIC
    truths = [None if is_chaotic else _truth(motion, span, start) for span in (span_s, solver_span_s)]
    costs = _costs(motion, start)
    responses = {level: _responses(motion, level, start) for level in LEVELS}
    levels = tuple(
        _level(motion, level, costs[level], responses, start, span_s, truths[0]) for level in LEVELS
    )
    solvers = tuple(_solver(name, motion, start, solver_span_s, truths[1]) for name in SOLVERS)
    return MotionBenchmark(motion, span_s, solver_span_s, levels, solvers)


def measure_transient(motion: Motion) -> tuple[TransientFigures, ...]:
    """Measure what every level errs by from rest, and what its answers say of it."""
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
    """Largest factor by which a change of the state, in its units, grows from some instant on."""
    ends = TRANSIENT_S * np.arange(1.0, LOOKS + 1.0) / LOOKS
    derivatives = [np.eye(6)] + [
        flow_derivative(motion.specimen, motion.drive, np.zeros(6), float(end_s))[1] for end_s in ends
    ]
    scale = STATE_UNITS / STATE_UNITS[:, None]
    onto_end = [derivatives[-1] @ np.linalg.inv(each) for each in derivatives[:-1]]
    return max(float(np.linalg.norm(each * scale, 2)) for each in (*derivatives, *onto_end))


def settled_state(motion: Motion) -> Floats:
    """State at the drive's phase zero after the transient, shape (6,)."""
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
    """Least processor time of each level over simulated time; not of the first round, which makes tables."""
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
    """Responses I and II from one start, or in chaos from several, shape (starts, 2)."""
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


def _solver(
    name: Solver, motion: Motion, start: Floats, span_s: float, truth: Floats | None
) -> SolverFigures:
    rates = rates_at(Place.ANYWHERE, law_of(motion.specimen), numbers_of(motion.specimen, motion.drive))
    rates(0.0, start)
    ends: list[Floats] = []

    def run() -> None:
        found = solve_ivp(
            rates, (0.0, span_s), start, method=name, rtol=SOLVER_RTOL, atol=SOLVER_ATOL, t_eval=[span_s]
        )
        ends.append(found.y[:, -1])

    cost = _run_time_s(run) / span_s
    return SolverFigures(name, cost, None if truth is None else state_error(ends[0], truth))


def _machine() -> str:
    return f"{next(_processor_names(), platform.machine())}, {os.cpu_count()} cores"


def _processor_names() -> Iterator[str]:
    described = Path("/proc/cpuinfo")
    if described.exists():
        for line in described.read_text(encoding="utf-8").splitlines():
            key, _, value = line.partition(":")
            if key.strip() == "model name":
                yield value.strip()
