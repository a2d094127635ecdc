"""The paper's Figures 3 and 10 as predictions, timed on this machine: ``python benchmarks/paper_figures.py``.

Every hertz from 10 to 600 at four amplitudes, 30 s each with the last 5 s observed, standard accuracy,
kernels compiled; as many threads as processors. Figure 10 asks for exponents besides.
"""

import argparse
import os
import time

from vibench.sim import Harmonic, Observable, Scene, gong2025, solve_scene
from vibench.sim.study import Study, solve_study

AMPLITUDES_M = (1e-6, 5e-6, 10e-6, 50e-6)
FREQUENCIES = {"start": 10, "stop": 600, "step": 1}
FIGURES = {3: (Observable.RESPONSE,), 10: (Observable.RESPONSE, Observable.LYAPUNOV)}


def main():
    """Time the figures asked for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("figures", type=int, nargs="*", default=[3, 10], help="3, 10, or both")
    for number in parser.parse_args().figures:
        observe = FIGURES[number]
        solve_scene(Scene(gong2025(), Harmonic(260.0, 5e-6), observe))
        study = Study(frequencies_hz=FREQUENCIES, amplitudes_m=AMPLITUDES_M, observe=observe, budget_s=0.0)
        began = time.perf_counter(), time.process_time()
        results = solve_study(study, workers=os.cpu_count())
        taken, work = time.perf_counter() - began[0], time.process_time() - began[1]
        points = study.grid.size
        print(
            f"Figure {number}: {points} points of 30 s in {taken:.1f} s on {os.cpu_count()} threads "
            f"({work:.1f} s of processor time); complete: {results.is_complete}"
        )


if __name__ == "__main__":
    main()
