"""What a chain costs against its length, and against the engine of one cell: ``python benchmarks/chain.py``.

Processor time, the shortest of a few runs; every cell starts in motion, so that all of them strike.
"""

import os
import time

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

from vibench.sim import Accuracy, Harmonic, gong2025, integrate
from vibench.sim.chain import (
    chain_energies,
    chain_lyapunov_exponent,
    chain_of,
    chain_response,
    integrate_chain,
)
from vibench.sim.chain._tables import chain_tables

REPEATS = 3
LENGTHS = (2, 4, 8, 16, 32, 64, 128, 256)
LONG = 8
"""Lengths from here on show how the cost goes on to grow."""
DRIVE = Harmonic(220.0, 40e-6)
DURATION_S = 0.5
DRIFT_SEEDS = range(10)
PERIODIC = Harmonic(130.0, 20e-6)
UNITS = np.repeat([1e-4, 0.1], 3)
"""Errors are in units of 100 um and 0.1 m/s."""


def best(job, repeats=REPEATS):
    """Shortest of a few runs [s of processor time], and the last result."""
    times = []
    for _ in range(repeats):
        start = time.process_time()
        result = job()
        times.append(time.process_time() - start)
    return min(times), result


def lively(cells):
    """Make a state in which every cell moves."""
    return np.random.default_rng(3).normal(size=(cells, 6)) * np.repeat([2e-5, 0.1], 3)


def report_first_use():
    """Compile, or load what is cached."""
    start = time.process_time()
    integrate_chain(chain_of(gong2025(), 1), PERIODIC, 0.01)
    print(f"first use of the chain's kernels: {time.process_time() - start:.1f} s")
    integrate(gong2025(), PERIODIC, 0.01)


def slope(lengths, costs):
    """Exponent of the power law through the points."""
    return np.polyfit(np.log(lengths), np.log(costs), 1)[0]


def report_lengths(accuracy):
    """Cost per impact and per simulated second against the number of cells."""
    print(f"{DRIVE.frequency_hz:.0f} Hz {DRIVE.amplitude_m * 1e6:.0f} um, {DURATION_S} s, {accuracy}")
    print("cells  impacts  set up (ms)  us/impact  ms per simulated s  responses  windows (us)")
    per_impact, per_second = [], []
    for cells in LENGTHS:
        chain, start = chain_of(gong2025(), cells), lively(cells)
        set_up, tables = best(lambda c=chain: chain_tables(c, DRIVE, accuracy))
        taken, run = best(lambda c=chain, s=start: integrate_chain(c, DRIVE, DURATION_S, accuracy, s))
        watched, response = best(
            lambda c=chain, s=start: chain_response(c, DRIVE, accuracy, DURATION_S, DURATION_S, s)
        )
        struck = int(response.impacts.sum())
        per_impact.append((taken - set_up) / run.impacts.count)
        per_second.append((taken - set_up) / DURATION_S)
        ratio = (watched - set_up) / struck / per_impact[-1]
        windows = " / ".join(f"{1e6 * window:.1f}" for window in tables.windows)
        print(
            f"{cells:5} {run.impacts.count:8} {set_up * 1e3:12.1f} {per_impact[-1] * 1e6:10.1f}"
            f" {per_second[-1] * 1e3:19.1f} {ratio:9.2f}x  {windows}"
        )
    far = LENGTHS.index(LONG)
    print(
        f"per impact ~ cells^{slope(LENGTHS, per_impact):.2f} (from {LONG} cells on "
        f"cells^{slope(LENGTHS[far:], per_impact[far:]):.2f}); per simulated second "
        f"~ cells^{slope(LENGTHS, per_second):.2f} (cells^{slope(LENGTHS[far:], per_second[far:]):.2f})"
    )


def report_one_cell():
    """One cell against the engine made for it: cost side by side, and how far they are apart."""
    specimen = gong2025(damping_time_s=3e-5)
    chain = chain_of(specimen, 1)
    reference = integrate(specimen, PERIODIC, 2.0, Accuracy.REFERENCE).final_state
    for accuracy in Accuracy:
        ours, run = best(lambda a=accuracy: integrate_chain(chain, PERIODIC, 2.0, a))
        theirs, other = best(lambda a=accuracy: integrate(specimen, PERIODIC, 2.0, a))
        error, other_error = (
            np.max(np.abs(state - reference) / UNITS) for state in (run.final_state[0], other.final_state)
        )
        print(
            f"one cell, 130 Hz 20 um, 2 s, {accuracy:9}: {ours * 1e3:.2f} ms, {ours / theirs:.1f} x the "
            f"engine of one cell; from reference {error:.1e} (that engine {other_error:.1e})"
        )


def report_drift():
    """Energy that undamped chains without a drive gain or lose in a second, over what they have."""
    for contact in ("hertz", "power:5", "linear_gap:2e5"):
        for cells in (1, 2, 4):
            chain = chain_of(gong2025(damping_time_s=0.0, contact=contact), cells)
            found = []
            for seed in DRIFT_SEEDS:
                start = np.random.default_rng(seed).normal(size=(cells, 6)) * np.repeat([3e-5, 0.15], 3)
                run = integrate_chain(chain, Harmonic(100.0, 0.0), 1.0, "standard", start)
                before, after = (chain_energies(chain, state).sum() for state in (start, run.final_state))
                found.append(after / before - 1.0)
            print(
                f"{contact}, {cells} cells: energy drifts by {min(found):.1e} to {max(found):.1e} in a second"
            )


def report_exponents():
    """Largest exponents of short chains."""
    for cells in (1, 2, 4, 8):
        taken, found = best(
            lambda n=cells: chain_lyapunov_exponent(chain_of(gong2025(), n), Harmonic(260.0, 5e-6)), 1
        )
        print(
            f"{cells} cells, 260 Hz 5 um: largest exponent {found.exponent_per_s:.1f} "
            f"+- {found.standard_error_per_s:.1f} 1/s, {found.impacts} impacts, {taken:.1f} s"
        )


if __name__ == "__main__":
    report_first_use()
    report_one_cell()
    for level in (Accuracy.STANDARD, Accuracy.REFERENCE):
        report_lengths(level)
    report_drift()
    report_exponents()
