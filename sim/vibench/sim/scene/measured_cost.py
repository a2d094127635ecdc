"""What runs of a scene's kind take on this machine: learnt from each, or measured where none was made."""

import time
from dataclasses import replace

from ..costs.ledger import FEWEST, Expected, cost_ledger
from .plan import ScenePlan, plan_scene
from .scene import Scene
from .solve import Question, Solver, settle_scene, solve_scene

MEASURED_S = 0.5
"""Processor time after which no further run is made to measure a cost [s]."""
DETUNED = (0.93, 1.07, 0.87, 1.13, 1.0)
"""Frequencies of the runs by which a cost is measured, over the scene's: neighbours differ as runs do."""

LEARNT_AS: dict[Solver, str] = {
    settle_scene: "settled",
    Question.MOTION: "settled in lanes",
    Question.ANSWER: "in lanes",
}
"""Solvers other than `solve_scene`, and what their runs are learnt as."""


def learn_cost(scene: Scene, taken_s: float, solver: Solver = solve_scene) -> None:
    """Note the processor time of a scene; modules and tables were loaded before."""
    plan = plan_scene(scene)
    cost_ledger().learn(_kind(plan, solver), plan.planned_s, taken_s)


def expected_cost_s(scene: Scene, solver: Solver = solve_scene) -> float:
    """Say how long a solver will take for a scene, by what such runs took lately [s].

    Raises ValueError when the specimen cannot be followed in time.
    """
    plan = plan_scene(scene)
    return _expected(plan, solver, plan.planned_s).time_s


def longest_cost_s(scene: Scene, solver: Solver = solve_scene) -> float:
    """Say how long a solver will take for a scene whose motion never repeats, by what such runs took [s].

    Raises ValueError when the specimen cannot be followed in time.
    """
    plan = plan_scene(scene)
    return _expected(plan, solver, plan.longest_planned_s).time_s


def _expected(plan: ScenePlan, solver: Solver, planned_s: float) -> Expected:
    """Go by what a solver's runs took, or else by those of `solve_scene`, which takes longest."""
    own = cost_ledger().expected(_kind(plan, solver), planned_s)
    return own if own.runs >= FEWEST else cost_ledger().expected(plan.kind, planned_s)


def _kind(plan: ScenePlan, solver: Solver) -> str:
    return f"{LEARNT_AS[solver]}/{plan.kind}" if solver in LEARNT_AS else plan.kind


def measure_cost(scene: Scene) -> None:
    """Run a few scenes like one that has been run, if what such scenes take on this machine is not known yet.

    It takes less than a second, unless one such scene takes longer.
    """
    kind, spent_s = plan_scene(scene).kind, 0.0
    for part in DETUNED:
        if cost_ledger().runs_of(kind) >= FEWEST or spent_s > MEASURED_S:
            return
        drive = replace(scene.drive, frequency_hz=part * scene.drive.frequency_hz)
        neighbour = replace(scene, drive=drive)
        begun_s = time.thread_time()
        solve_scene(neighbour)
        taken_s = time.thread_time() - begun_s
        learn_cost(neighbour, taken_s)
        spent_s += taken_s
