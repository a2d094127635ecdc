"""Expected computing times on this machine, from previous runs or, for scenes with a target, a pilot run.

A ledger stores, for every kind of run, mean and scatter of the logarithm of actual / planned time.
"""

import atexit
import contextlib
import hashlib
import json
import math
import platform
import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from functools import cache
from itertools import accumulate
from pathlib import Path
from typing import Self

import numpy as np

from ..engine.library import physics_digest
from ..operating_system.this import replace_file, state_folder, state_place
from .plan import ScenePlan, plan_scene
from .refinement import HOPELESS_S, LONGEST_S, refine_to_end, takes_too_long
from .scene import Scene
from .solve import InBatches, Question, Solver, settle_scene, solve_scene

MEMORY = 20
"""Memory of the moving average: after this number of later runs, a run keeps a third of its weight."""
SURPRISE = math.log(2.5)
"""Limit of a run's logarithmic deviation from the mean of similar runs, in case of an unusual motion."""
FEWEST = 3
"""Smallest number of runs of a kind from which the scatter of their computing times is estimated."""
PRIOR = 4.0
"""Weight of the more general kind in a kind's statistics [runs]; less if the general kind scatters more."""
UNKNOWN_FACTOR = 10.0
"""Uncertainty factor of an expected computing time if no run of that kind is known."""
LEAST_FACTOR = 1.5
SURE, FEW = 2.0, 1.6
"""Coefficients of an approximation to Student's t for 95 % of runs: t = SURE (1 + FEW / (runs - 1))."""
SAVED_EVERY_S = 5.0


@dataclass(frozen=True)
class _Kind:
    """Statistics of the logarithm of actual / planned time, for one kind of run."""

    runs: int = 0
    mean: float = 0.0
    variance: float = 0.0

    def off(self, ratio: float) -> float:
        """Return a run's logarithmic deviation from the mean, limited if enough runs are known."""
        off = math.log(ratio) - self.mean
        return off if self.runs < FEWEST else max(-SURPRISE, min(SURPRISE, off))

    def near(self, general: Self) -> Self:
        """Return the statistics combined with a more general kind's, which count as up to `PRIOR` runs."""
        prior = PRIOR if general.runs else 0.0
        if self.runs >= FEWEST and self.variance < general.variance:
            prior *= self.variance / general.variance
        share = self.runs / (self.runs + prior)
        mean = general.mean + share * (self.mean - general.mean)
        variance = general.variance + share * (self.variance - general.variance)
        return type(self)(self.runs if self.runs >= FEWEST else general.runs, mean, variance)

    def after(self, ratio: float) -> Self:
        """Return the statistics with one more run; old runs lose weight (West, Comm. ACM 22 (1979) 532)."""
        runs = min(self.runs + 1, MEMORY)
        off, share = math.log(ratio) - self.mean, 1.0 / runs
        spread = (1.0 - share) * (self.variance + share * off * off)
        return type(self)(runs, self.mean + share * self.off(ratio), spread)


@dataclass(frozen=True)
class ExpectedTime:
    """Expected computing time with its uncertainty."""

    time_s: float
    """Expected computing time on one core of this machine [s]."""
    factor: float
    """Uncertainty factor: 95 % of such runs take from ``time_s / factor`` to ``time_s * factor``."""
    runs: int
    """Number of known runs on which the expected time is based."""

    def __str__(self) -> str:
        """Return the expected computing time as text."""
        time_s, factor = self.time_s, self.factor
        learnt = f"{self.runs} such runs" if self.runs >= FEWEST else "too few such runs"
        text = f"{time_s:.1g} s within a factor of {factor:.2g}"
        if factor > 10.0:  # such an uncertain value would mislead
            text = f"between {time_s / factor:.1g} and {time_s * factor:.1g} s"
        return f"Estimated time on one core: {text}, based on {learnt} on this machine."


class CostLedger:
    """Computing times by kind of run, shared by all threads of a process."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._lock = threading.Lock()
        self._kinds = _read(path)
        self._saved_s = time.monotonic()
        self._is_new = False
        self._lately = deque[float](maxlen=MEMORY)
        """Logarithmic deviations of the latest runs of any kind, to detect that the machine became slower."""

    def expected_time(self, kind: str, planned_s: float) -> ExpectedTime:
        """Return the expected time of a run; a new kind uses the statistics of a more general kind."""
        with self._lock:
            known, drift = self._statistics(kind), self._drift
        factor = UNKNOWN_FACTOR
        if known.runs >= FEWEST:
            # The next run's variance is the scatter of the runs plus the uncertainty of their mean.
            spread = math.sqrt(known.variance * (1.0 + 1.0 / known.runs) * known.runs / (known.runs - 1.0))
            factor = max(LEAST_FACTOR, math.exp(SURE * (1.0 + FEW / (known.runs - 1.0)) * spread))
        return ExpectedTime(planned_s * math.exp(known.mean + drift), factor, known.runs)

    def learn(self, kind: str, planned_s: float, taken_s: float) -> None:
        """Record the computing time of a run [s], excluding the loading of modules."""
        if not (planned_s > 0.0 and taken_s > 0.0):
            return
        with self._lock:
            known = self._statistics(kind)
            if known.runs >= FEWEST:
                self._lately.append(known.off(taken_s / planned_s))
            for name in _names(kind):
                self._kinds[name] = self._kinds.get(name, _Kind()).after(taken_s / planned_s)
            self._is_new = True
        if time.monotonic() - self._saved_s > SAVED_EVERY_S:
            self.save()

    def _statistics(self, kind: str) -> _Kind:
        """Return the statistics of a kind of run and, if such runs are few, of more general kinds."""
        known = _Kind()
        for name in _names(kind):
            known = self._kinds[name].near(known) if name in self._kinds else known
        return known if known.runs >= FEWEST else _Kind()

    @property
    def _drift(self) -> float:
        """Return the mean logarithmic deviation of the latest runs; 0 unless the mean is significant."""
        runs = len(self._lately)
        if runs < MEMORY // 2:
            return 0.0
        mean, scatter = float(np.mean(self._lately)), float(np.std(self._lately, ddof=1))
        return mean if abs(mean) > SURE * scatter / math.sqrt(runs) else 0.0

    def save(self) -> None:
        """Write new computing time statistics to the ledger's file, if possible."""
        with self._lock:
            self._saved_s = time.monotonic()
            if not self._is_new:
                return
            self._is_new = False
            text = json.dumps({kind: asdict(known) for kind, known in sorted(self._kinds.items())}, indent=1)
        with contextlib.suppress(OSError):
            self._path.parent.mkdir(parents=True, exist_ok=True)
            with replace_file(self._path) as coming:
                coming.write_text(text, encoding="utf-8")


def _names(kind: str) -> list[str]:
    """Return the names of the more general kinds ``a``, ``a/b``, and of the kind ``a/b/c``."""
    return list(accumulate(kind.split("/"), "{}/{}".format))


def _read(path: Path) -> dict[str, _Kind]:
    """Return the computing time statistics from a file, by kind of run; empty without a valid file."""
    try:
        kept = json.loads(path.read_text(encoding="utf-8"))
        known = {kind: _Kind(**each) for kind, each in kept.items()}
        is_sound = all(
            each.runs > 0 and math.isfinite(each.mean) and 0.0 <= each.variance < math.inf
            for each in known.values()
        )
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return {}
    return known if is_sound else {}


@cache
def cost_ledger() -> CostLedger:
    """Return the ledger for this machine, Python version and engine source; it is saved at exit."""
    about = platform.node(), platform.machine(), platform.python_version(), physics_digest()
    name = hashlib.sha256("\n".join(about).encode()).hexdigest()[:16]
    with contextlib.suppress(OSError):  # without a state folder, statistics are not saved
        state_folder()
    ledger = CostLedger(state_place() / "costs" / f"{name}.json")
    atexit.register(ledger.save)
    return ledger


PILOTS, PILOT_S, PILOT_SHARE = 16, 1.0, 0.25
"""Pilot runs of scenes with a target: largest number of scenes, total time [s], and share of the remaining
time that each scene may use."""
UNDECIDED = 3.0
"""Assumed ratio of a scene's time to its pilot run's time, if the pilot run missed the target."""

LEARNT_AS: dict[Solver, str] = {
    settle_scene: "settled",
    InBatches(Question.MOTION): "settled in lanes",
    InBatches(Question.ANSWER): "in lanes",
}
"""First part of a run's kind in the ledger, for solvers other than `solve_scene`."""


def learn_cost(scene: Scene, taken_s: float, solver: Solver = solve_scene) -> None:
    """Record the processor time [s] of a scene, excluding the loading of modules and tables."""
    plan = plan_scene(scene)
    cost_ledger().learn(_kind(plan, solver), plan.planned_s, taken_s)


def expected_cost_s(scene: Scene, solver: Solver = solve_scene, *, may_repeat: bool = True) -> float:
    """Return the expected computing time [s], from recent runs of this solver, else of `solve_scene`.

    ``may_repeat`` is False for an upper bound. Raises ValueError when the specimen cannot be simulated.
    """
    plan = plan_scene(scene)
    planned_s = plan.planned_s if may_repeat else plan.longest_planned_s
    own = cost_ledger().expected_time(_kind(plan, solver), planned_s)
    return own.time_s if own.runs >= FEWEST else cost_ledger().expected_time(plan.kind, planned_s).time_s


def pilot_cost_s(scene: Callable[[int], Scene], count: int) -> float:
    """Return the mean computing time of ``count`` scenes with a target [s], from pilot runs of some scenes.

    Pilot runs are needed because the time depends on the motion's sensitivity to its start, which is not
    known beforehand. An invalid scene counts as zero time.
    """
    ends_s, costs = time.monotonic() + PILOT_S, list[float]()
    for number in np.random.default_rng(count).permutation(count)[:PILOTS]:
        left_s = ends_s - time.monotonic()
        if left_s < (1.0 - PILOT_SHARE) ** PILOTS * PILOT_S:
            break
        try:
            costs.append(_target_cost_s(scene(int(number)), PILOT_SHARE * left_s))
        except ValueError:
            costs.append(0.0)
    return math.fsum(costs) / len(costs)


def _target_cost_s(scene: Scene, most_s: float) -> float:
    """Solve a scene for at most ``most_s``; return the estimated time of the complete solution [s]."""
    assert scene.target is not None
    limit_s = LONGEST_S if scene.target.time_s is None else scene.target.time_s
    tried_s, began_s = min(most_s, limit_s), time.monotonic()
    report = refine_to_end(replace(scene, target=replace(scene.target, time_s=tried_s))).target
    assert report is not None
    taken_s = time.monotonic() - began_s
    if taken_s < tried_s or (report.is_met and scene.target.error is not None):
        return taken_s
    if takes_too_long(replace(report, wanted_time_s=scene.target.time_s)):
        return HOPELESS_S
    if report.needed_s is not None:
        return min(limit_s, report.needed_s[0])
    # A scene without a target error uses its whole time limit.
    return limit_s if scene.target.error is None else min(limit_s, UNDECIDED * taken_s)


def _kind(plan: ScenePlan, solver: Solver) -> str:
    return f"{LEARNT_AS[solver]}/{plan.kind}" if solver in LEARNT_AS else plan.kind
