"""A process for kill tests: it computes a study or a map, and prints the number of stored points."""

import sys
from pathlib import Path

from vibench.sim.maps import Map, Range, open_map, solve_map
from vibench.sim.study import ExistingStudy, Study, open_study, solve_study

STUDY = Study(
    frequencies_hz={"start": 180.0, "stop": 300.0, "step": 4.0},
    amplitudes_m=(2e-6, 10e-6),
    starts=("rest", "up"),
    duration_s=2.0,
    window_s=1.0,
    budget_s=0.0,
)
MAP = Map(
    frequency_hz=Range(start=80.0, stop=300.0, points=21),
    amplitude_m=Range(start=1e-6, stop=3e-5, points=15, spacing="logarithmic"),
    periods=800,
)
PLANS = {"study": (STUDY, solve_study, open_study), "map": (MAP, solve_map, open_map)}
"""For each kind of plan: the plan, and the functions that solve and open it."""


def main(kind, path):
    def report(progress):
        sys.stdout.write(f"{progress.done}\n")
        sys.stdout.flush()

    plan, solve, _ = PLANS[kind]
    solve(plan, Path(path), ExistingStudy.RESUME, workers=2, observer=report)


if __name__ == "__main__":
    main(*sys.argv[1:])
