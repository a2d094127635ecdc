"""Speed and accuracy of the engine on this machine: ``python benchmarks/flight.py``."""

import time

import numpy as np

from vibench.sim import Accuracy, Harmonic, LinearSweep, Sampled, gong2025, integrate
from vibench.sim.engine.run import CubicRun, RunRecord

REPEATS = 3
UNITS = np.repeat([1e-4, 0.1], 3)
"""Units of errors of the state: 100 um and 0.1 m/s."""

RUNS = ((Harmonic(130.0, 20e-6), 2.0), (Harmonic(260.0, 5e-6), 0.05), (Harmonic(260.0, 5e-6), 30.0))
"""Drives and durations: periodic; chaotic, short enough for runs to agree; chaotic, too long for that."""


def best(job):
    """Return the shortest time of a few runs [s], and the last result."""
    times = []
    for _ in range(REPEATS):
        start = time.perf_counter()
        result = job()
        times.append(time.perf_counter() - start)
    return min(times), result


def carry(pieces, interval_s):
    """Advance a run over many intervals of a sampled drive."""
    CubicRun(gong2025(), interval_s, np.zeros(6), Accuracy.STANDARD.tolerance).advance(pieces, RunRecord(0))


def report_first_use():
    """Print the time of the first use, which loads the engine."""
    start = time.perf_counter()
    integrate(gong2025(), Harmonic(130.0, 20e-6), 0.01)
    integrate(gong2025(), LinearSweep(100.0, 110.0, 0.1, 20e-6), 0.1)
    print(f"first use of the engine: {time.perf_counter() - start:.1f} s")


def report_runs():
    """Print time and error of each accuracy level, against the reference level."""
    specimen = gong2025(damping_time_s=3e-5)
    for drive, duration_s in (
        (Harmonic(130.0, 20e-6), 2.0),
        (Harmonic(260.0, 5e-6), 0.05),
        (Harmonic(260.0, 5e-6), 30.0),
    ):
        reference = integrate(specimen, drive, duration_s, Accuracy.REFERENCE).final_state
        for accuracy in Accuracy:
            taken, run = best(lambda d=drive, t=duration_s, a=accuracy: integrate(specimen, d, t, a))
            error = np.max(np.abs(run.final_state - reference) / UNITS)
            name = (
                f"{drive.frequency_hz:.0f} Hz {drive.amplitude_m * 1e6:.0f} um, {duration_s} s, {accuracy:9}"
            )
            cost = f"{taken * 1e3:.2f} ms, {taken / duration_s * 1e3:.2f} ms/s, {run.impacts.count} impacts"
            print(f"{name}: {cost}, from reference {error:.1e}")


def report_intervals():
    """Print the cost of an interval of a sampled drive."""
    pieces = np.zeros((200_000, 4))
    taken, _ = best(lambda: carry(pieces, 1e-5))
    print(f"interval of 10 us, clear of the stops: {taken / len(pieces) * 1e9:.0f} ns")
    rate = 1e5
    sine = 20e-6 * np.sin(2.0 * np.pi * 130.0 * np.arange(200_001) / rate)
    taken, run = best(lambda: integrate(gong2025(damping_time_s=3e-5), Sampled(sine, rate), 2.0))
    print(f"sampled 130 Hz 20 um, 2 s at 100 kHz: {taken * 1e3:.1f} ms, {run.impacts.count} impacts")


if __name__ == "__main__":
    report_first_use()
    report_runs()
    report_intervals()
