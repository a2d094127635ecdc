"""A process for kill tests: it computes a map into a file and prints the number of stored points."""

import sys
from pathlib import Path

from vibench.sim.maps import Map, Range, solve_map
from vibench.sim.study import ExistingStudy

PLAN = Map(
    frequency_hz=Range(start=80.0, stop=300.0, points=29),
    amplitude_m=Range(start=1e-6, stop=3e-5, points=21, spacing="logarithmic"),
    periods=800,
)


def main(path):
    def report(progress):
        sys.stdout.write(f"{progress.done}\n")
        sys.stdout.flush()

    solve_map(PLAN, Path(path), ExistingStudy.RESUME, workers=2, observer=report)


if __name__ == "__main__":
    main(sys.argv[1])
