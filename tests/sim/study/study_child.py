"""A process for kill tests: it runs a study into a file and prints the number of stored points."""

import sys
from pathlib import Path

from vibench.sim.study import ExistingStudy, Study, solve_study

STUDY = Study(
    frequencies_hz={"start": 180.0, "stop": 300.0, "step": 2.0},
    amplitudes_m=(2e-6, 5e-6, 10e-6),
    starts=("rest", "up"),
    duration_s=2.0,
    window_s=1.0,
    budget_s=0.0,
)


def main(path):
    def report(progress):
        sys.stdout.write(f"{progress.done}\n")
        sys.stdout.flush()

    solve_study(STUDY, Path(path), ExistingStudy.RESUME, workers=2, observer=report)


if __name__ == "__main__":
    main(sys.argv[1])
