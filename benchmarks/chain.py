"""Measure the cost of chains, also against the engine for one cell: ``python benchmarks/chain.py``.

Times are the shortest processor time of a few runs. Every cell starts in motion, so that all have impacts.
"""

import os
import time

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

from vibench.sim import Accuracy, Harmonic, gong2025, integrate, steady_response
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
"""Length from which the growth of the cost is also fitted separately."""
DRIVE = Harmonic(220.0, 40e-6)
DURATION_S = 0.5
DRIFT_SEEDS = range(10)
PERIODIC = Harmonic(130.0, 20e-6)
LAWS = ("hertz", "linear", "linear_gap:2e5", "hunt_crossley:0.5", "power:5", "power:3+5+7")
DAMPINGS_S = (0.0, 2e-5, 1e-4)
ONE_CELL_DRIVES = (PERIODIC, DRIVE, Harmonic(300.0, 5e-6))
SETTLE_S = 5.0
WATCHED = (2, 8)


def best(job, repeats=REPEATS):
    """Return the shortest processor time of a few runs [s], and the last result."""
    times = []
    for _ in range(repeats):
        start = time.process_time()
        result = job()
        times.append(time.process_time() - start)
    return min(times), result


def moving_state(cells):
    """Return a random state in which every cell moves."""
    return np.random.default_rng(3).normal(size=(cells, 6)) * np.repeat([2e-5, 0.1], 3)


def slope(lengths, costs):
    """Return the exponent of a power law fitted to the points."""
    return np.polyfit(np.log(lengths), np.log(costs), 1)[0]


def report_lengths(accuracy):
    """Print the cost per impact and per simulated second for each number of cells."""
    print(f"{DRIVE.frequency_hz:.0f} Hz {DRIVE.amplitude_m * 1e6:.0f} um, {DURATION_S} s, {accuracy}")
    print("cells  impacts  set up (ms)  us/impact  ms per simulated s  responses  windows (us)")
    per_impact, per_second = [], []
    for cells in LENGTHS:
        chain, start = chain_of(gong2025(), cells), moving_state(cells)
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
    """Compare a chain of one cell with its specimen, from rest and settled: time and final state."""
    print("one cell over its specimen, 2 s, standard: time of responses, of motion (the same motion?)")
    for contact in LAWS:
        for damping_time_s in DAMPINGS_S:
            specimen = gong2025(damping_time_s=damping_time_s, contact=contact)
            row = []
            for drive in ONE_CELL_DRIVES:
                settled = integrate(specimen, drive, SETTLE_S).final_state
                row += [one_cell_over_specimen(specimen, drive, state) for state in (np.zeros(6), settled)]
            print(f"{contact:18} {damping_time_s * 1e6:3.0f} us  {'  '.join(row)}")


def one_cell_over_specimen(specimen, drive, state):
    """Return the time ratios of responses and of motion, and whether both engines end in the same state."""
    chain, start = chain_of(specimen, 1), state[None, :]
    alone, theirs = best(lambda: steady_response(specimen, drive, "standard", 2.0, 1.0, state))
    row, ours = best(lambda: chain_response(chain, drive, "standard", 2.0, 1.0, start))
    alone_s, _ = best(lambda: integrate(specimen, drive, 2.0, "standard", state))
    chain_s, _ = best(lambda: integrate_chain(chain, drive, 2.0, "standard", start))
    same = np.array_equal(ours.final_state[0], theirs.final_state) and (
        float(ours.largest_m[0, 0]),
        float(ours.largest_m[0, 1]),
    ) == (theirs.largest_x_m, theirs.largest_p_m)
    return f"{row / alone:.2f} {chain_s / alone_s:.2f} {'=' if same else 'DIFFERS'}"


def report_watching():
    """Print by how much observing responses increases the cost of a motion, for every contact law."""
    print("responses over the motion alone, 1 s, standard, every cell struck at the start")
    for contact in LAWS:
        row = []
        for cells in WATCHED:
            chain, start = chain_of(gong2025(contact=contact), cells), moving_state(cells)
            motion, _ = best(lambda c=chain, s=start: integrate_chain(c, DRIVE, 1.0, "standard", s))
            watched, _ = best(lambda c=chain, s=start: chain_response(c, DRIVE, "standard", 1.0, 1.0, s))
            row.append(f"{cells} cells {watched / motion:.2f}x")
        print(f"{contact:18} {'  '.join(row)}")


def report_drift():
    """Print the relative change of energy of undamped chains without a drive in a second."""
    for contact in ("hertz", "power:5", "linear_gap:2e5"):
        for cells in (1, 2, 4, 20):
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
    """Print the largest exponents of short chains."""
    for cells in (1, 2, 4, 8):
        taken, found = best(
            lambda n=cells: chain_lyapunov_exponent(chain_of(gong2025(), n), Harmonic(260.0, 5e-6)), 1
        )
        print(
            f"{cells} cells, 260 Hz 5 um: largest exponent {found.exponent_per_s:.1f} "
            f"+- {found.standard_error_per_s:.1f} 1/s, {found.impacts} impacts, {taken:.1f} s"
        )


if __name__ == "__main__":
    report_one_cell()
    report_watching()
    for level in (Accuracy.STANDARD, Accuracy.REFERENCE):
        report_lengths(level)
    report_drift()
    report_exponents()
