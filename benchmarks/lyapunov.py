"""Measure the cost of Lyapunov exponents; compute Figure 10: ``python benchmarks/lyapunov.py --help``.

Cost is the ratio to the same run without a tangent; both are timed in turn, and the shortest time counts. The
amplitudes of the figure are those of the paper's four cases. The paper does not state the frequencies; here
they are every hertz from 10 to 600.
"""

import argparse
import os
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from vibench.sim import Accuracy, Harmonic, gong2025, lyapunov_exponent
from vibench.sim.engine.run import NativeRun, RunRecord
from vibench.sim.exponents.lyapunov import Precision

REPEATS = 5
COST_S = 10.0
"""Simulated time of the runs that are timed [s]."""
STATES = (
    ("hertz", Harmonic(260.0, 5e-6)),
    ("hertz", Harmonic(130.0, 20e-6)),
    ("hertz", Harmonic(430.0, 50e-6)),
    ("linear_gap", Harmonic(260.0, 5e-6)),
    ("rigid:0.8", Harmonic(260.0, 5e-6)),
    ("power:5", Harmonic(260.0, 5e-6)),
    ("power:47", Harmonic(260.0, 5e-6)),
)
AMPLITUDES_M = (1e-6, 5e-6, 10e-6, 50e-6)


def run(specimen, drive, changes):
    """Run with ``changes`` tangent vectors; return processor time [s] and number of impacts."""
    moving = NativeRun(specimen, drive, np.zeros(6), Accuracy.STANDARD.tolerance)
    moving.carry(np.eye(6)[:changes])
    record = RunRecord(round(1e4 * COST_S))
    start = time.process_time()
    moving.advance(COST_S, record)
    return time.process_time() - start, record.impacts


def report_cost():
    """Print the cost of a run with one and with six tangent vectors, relative to the run alone."""
    for law, drive in STATES:
        specimen, times = gong2025(contact=law), {0: [], 1: [], 6: []}
        for _ in range(REPEATS):
            for changes, taken in times.items():
                taken.append(run(specimen, drive, changes)[0])
        alone, one, six = (min(times[changes]) for changes in (0, 1, 6))
        impacts = run(specimen, drive, 0)[1] / COST_S
        name = f"{law:10} {drive.frequency_hz:.0f} Hz {drive.amplitude_m * 1e6:.0f} um"
        print(
            f"{name}: {alone / COST_S * 1e3:.2f} ms/s alone, {impacts:.0f} impacts/s; "
            f"one change x {one / alone:.2f}, six x {six / alone:.2f}"
        )


def figure_10(contact, frequencies_hz, accuracy, precision, workers):
    """Compute the largest exponents at every amplitude, on several threads, and print a summary."""
    specimen = gong2025(contact=contact)
    for amplitude in AMPLITUDES_M:
        start = time.perf_counter()

        def point(frequency, amplitude=amplitude):
            drive = Harmonic(float(frequency), amplitude)
            return lyapunov_exponent(specimen, drive, accuracy, precision=precision)

        with ThreadPoolExecutor(workers) as pool:
            # Neighbouring points take similar times, so a stride distributes slow ones over the threads.
            order = np.argsort(np.arange(len(frequencies_hz)) % 7, kind="stable")
            found = list(pool.map(point, frequencies_hz[order]))
        taken = time.perf_counter() - start
        kinds = Counter(each.verdict.name.lower() for each in found)
        largest = max(found, key=lambda each: each.exponent_per_s)
        transients = [each for each in found if each.transient is not None]
        print(
            f"{contact} {amplitude * 1e6:.0f} um: {len(found)} frequencies in {taken:.1f} s; {dict(kinds)}; "
            f"largest {largest.exponent_per_s:.1f} +- {largest.standard_error_per_s:.1f} /s at "
            f"{largest.drive.frequency_hz:.0f} Hz; chaos died out at {len(transients)}"
        )
        for each in sorted(transients, key=lambda each: each.drive.frequency_hz):
            gone = each.transient
            print(
                f"    {each.drive.frequency_hz:.0f} Hz: {gone.exponent_per_s:.1f} /s until "
                f"{gone.until_s:.2f} s ({gone.impacts} impacts); then {each.exponent_per_s:.2f} /s: "
                f"{each.motion}"
            )
        yield taken


def main():
    """Measure the cost and compute the requested exponents."""
    parser = argparse.ArgumentParser(description="Cost of exponents, and the paper's Figure 10.")
    parser.add_argument("--start", type=float, default=10.0, help="first frequency [Hz]")
    parser.add_argument("--stop", type=float, default=600.0, help="last frequency [Hz]")
    parser.add_argument("--step", type=float, default=1.0, help="between frequencies [Hz]")
    parser.add_argument("--contact", default="hertz", help="a model's name")
    parser.add_argument("--accuracy", type=Accuracy, default=Accuracy.STANDARD, choices=list(Accuracy))
    parser.add_argument(
        "--error", type=float, default=0.0, help="stop a run at this relative error; 0: never"
    )
    parser.add_argument("--workers", type=int, default=os.cpu_count())
    asked = parser.parse_args()
    report_cost()
    frequencies = np.arange(asked.start, asked.stop + 0.5 * asked.step, asked.step)
    lyapunov_exponent(gong2025(contact=asked.contact), Harmonic(260.0, 5e-6), duration_s=2.0)
    precision = Precision(2.0, asked.error) if asked.error > 0.0 else None
    busy = time.process_time()
    total = sum(figure_10(asked.contact, frequencies, asked.accuracy, precision, asked.workers))
    busy = time.process_time() - busy
    count = len(AMPLITUDES_M) * len(frequencies)
    print(f"Figure 10, {asked.contact}: {count} exponents in {total:.1f} s, {busy:.1f} processor seconds")


if __name__ == "__main__":
    main()
