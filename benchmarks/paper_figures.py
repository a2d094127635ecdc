"""Measure the computing time of the paper's Figures 3 and 10: ``python benchmarks/paper_figures.py``.

The figures have every hertz from 10 to 600 at four amplitudes, 30 s each with the last 5 s observed, at
standard accuracy; Figure 10 also has exponents. "3 to 1 %" is Figure 3 with a target error at every tenth
hertz, and at most five seconds per point. A further curve has 121 points at 20 um, with other initial states
where needed, as `vibench predict` computes it. Each runs on one thread per processor, in batches as for a
study of this size, and one motion after the other.
"""

import argparse
import os
import time

import numpy as np

from vibench.sim import Harmonic, Observable, Scene, gong2025, solve_scene
from vibench.sim.scene.solve import InBatches
from vibench.sim.study import MemoryStore, Study, ThreadExecutor, run_study
from vibench.sim.study._executor import solve_timed

FIGURE = {
    "amplitudes_m": (1e-6, 5e-6, 10e-6, 50e-6),
    "frequencies_hz": {"start": 10, "stop": 600, "step": 1},
    "budget_s": 0.0,
}
ASKED = {
    "3": FIGURE,
    "10": FIGURE | {"observe": (Observable.RESPONSE, Observable.LYAPUNOV)},
    "3 to 1 %": {
        "amplitudes_m": FIGURE["amplitudes_m"],
        "frequencies_hz": {"start": 10, "stop": 600, "step": 10},
        "error": 0.01,
        "time_s": 5.0,
    },
    "curve": {"amplitudes_m": (20e-6,), "frequencies_hz": {"start": 100, "stop": 400, "step": 2.5}},
}
SOLVERS = {"in batches": InBatches(), "one by one": solve_scene}


def main():
    """Time the requested figures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("asked", nargs="*", default=list(ASKED), help=", ".join(ASKED))
    for name in parser.parse_args().asked:
        study = Study(**ASKED[name])
        ways = SOLVERS if study.target is None else {"one by one": solve_scene}
        for way, solver in ways.items():
            first = Scene(gong2025(), Harmonic(260.0, 5e-6), study.observe, budget_s=study.budget_s)
            list(solve_timed([first], solver))
            executor, store = ThreadExecutor(os.cpu_count(), solver), MemoryStore(study)
            began = time.perf_counter(), time.process_time()
            run_study(study, executor, store)
            taken, work = time.perf_counter() - began[0], time.process_time() - began[1]
            executor.close()
            print(
                f"{name}, {way}: {study.grid.size} points in {taken:.1f} s on {executor.slots} "
                f"threads ({work:.1f} s of processor time)"
            )
            if study.target is not None:
                print(
                    f"{np.mean(store.arrays['error_estimate'] <= study.error):.0%} of the points reached it"
                )


if __name__ == "__main__":
    main()
