"""Print the tables of docs/paper.md: ``python benchmarks/paper_tables.py``, which takes minutes.

The tables show where linear motion reaches the gap, exponents at 5 um around two resonances, and how textbook
methods change the energy of an impact and the exponent at 260 Hz. Options are those of `vibench reproduce`.
"""

from dataclasses import replace

import numpy as np

from vibench.cli.paper.options import ALIKE, BY_ODE45, SCORED_S, Case, damping
from vibench.cli.paper.reading import MODERATE_M, Evidence, Reading
from vibench.cli.paper.textbook_methods import Tableau, TextbookMethod, march, ode45, textbook_exponents
from vibench.sim import Accuracy, Harmonic, base_transmissibility
from vibench.sim.study import solve_study

RUNGE_KUTTA = Tableau(
    np.array([0.0, 0.5, 0.5, 1.0]),
    np.diag([0.5, 0.5, 1.0], -1),
    np.array([1.0, 2.0, 2.0, 1.0]) / 6.0,
    np.zeros(4),
)
"""Classical method of fourth order."""


def runge_kutta(step_s):
    """Return the classical fourth-order method with fixed steps.

    Raises ValueError when the step is not positive and finite.
    """
    if not 0.0 < step_s < np.inf:
        raise ValueError(f"A step of {step_s} s is not allowed: it must be positive and finite.")
    return TextbookMethod(f"Runge-Kutta, steps of {step_s:g} s", RUNGE_KUTTA, step_s)


def textbook_states(specimen, drive, method, duration_s, initial_states):
    """Integrate motions from time zero and return their final states, shape (n, 6); NaN after divergence.

    ``initial_states`` has shape (n, 6): x, y, z, vx, vy, vz, absolute [m, m/s]. Raises ValueError for rigid
    stops.
    """
    states = np.array(initial_states, dtype=np.float64).T
    drives = [drive] * states.shape[1]
    ends, _ = march(states[:, np.newaxis], duration_s, duration_s, specimen, drives, method)
    return ends[:, 0].T


SHOWN_HZ = (90.0, 95.0, 100.0, 105.0, 250.0, 260.0, 270.0, 280.0)
NEAR_HZ, SECOND_HZ = np.arange(80.0, 110.0, 0.01), np.arange(230.0, 310.0, 0.01)
SPEEDS = (0.03, 0.1, 0.3)
"""Typical approach velocities of the impacts at these drives [m/s]."""
REACH_HEADINGS = (
    "A0 at which p reaches the gap at this peak [µm]",
    "frequencies at which p reaches the gap at 5 µm [Hz]",
)
METHODS = (ode45(), *(runge_kutta(each) for each in (2e-5, 1e-5, 5e-6)))
METHOD_HEADINGS = (
    "energy after / before an impact at 0.03, 0.1, 0.3 m/s",
    "exponent at 260 Hz and 5 µm [1/s]",
)
SHORT_M, LONG_S = 1e-5, 1e-3
"""A gap that is crossed quickly [m], and a time after which every impact is over [s]."""
MOTIONS, DECAYED_S = 50, 0.25
"""Number of motions, which start at different drive phases, and time until their transients decay [s]."""
PHASES = 50
"""Number of phases within a step at which a contact begins."""


def main():
    """Print the tables of the page."""
    case = Case(accuracy=Accuracy.QUICK)
    evidence = Evidence(solve_study)
    head = "damping", "peak of \\|x / U\\| near 95 Hz", *REACH_HEADINGS
    show(head, (reach(each.of(case)) for each in (*map(damping, SCORED_S), ALIKE)))
    settings = (damping(1e-5).of(case), case, ALIKE.of(case), BY_ODE45.of(case))
    levels = [Reading(evidence, each).level(MODERATE_M) for each in settings]
    columns = [dict(zip(each.frequency_hz, each.exponent_per_s, strict=True)) for each in levels]
    rows = ((f"{f:g}", *(f"{each[f]:.0f}" for each in columns)) for f in SHOWN_HZ)
    show(("frequency [Hz]", *(each.name for each in settings)), rows)
    exact = ("exact free motion, integrated contact", "1, 1, 1", f"{columns[1][260.0]:.0f}")
    show(("method", *METHOD_HEADINGS), (exact, *(textbook(case, each) for each in METHODS)))


def show(headings, rows):
    """Print a table in Markdown."""
    print(f"| {' | '.join(headings)} |\n|{'---|' * len(headings)}")
    for row in rows:
        print(f"| {' | '.join(row)} |", flush=True)
    print()


def reach(case):
    """Return a row: level at which p reaches the gap at the first resonance, and range of contact at 5 um."""
    specimen = case.specimen()
    x, _, _, p = np.abs(base_transmissibility(specimen, NEAR_HZ)).T
    over = SECOND_HZ[np.abs(base_transmissibility(specimen, SECOND_HZ)[:, 3]) * MODERATE_M > case.gap_m]
    ends = f"{over[0]:.1f} to {over[-1]:.1f}" if over.size else "nowhere"
    return case.name, f"{x.max():.3g}", f"{1e6 * case.gap_m / p.max():.3g}", ends


def textbook(case, method):
    """Return a row: energy kept in impacts, and exponent at 260 Hz and 5 um, of a method."""
    specimen, settle_s = case.specimen(), case.window_s
    kept = ", ".join(f"{energy_ratio(specimen, method, each):.3g}" for each in SPEEDS)
    drives = [Harmonic(260.0, MODERATE_M, phase) for phase in 2.0 * np.pi * np.arange(MOTIONS) / MOTIONS]
    kept_s = (case.duration_s - settle_s) / MOTIONS
    found = textbook_exponents(specimen, drives, method, kept_s, DECAYED_S)
    return method.name, kept, f"{found.mean():.0f}"


def energy_ratio(specimen, method, speed):
    """Return the energy of m1 and m2 after an isolated impact, over that before."""
    free = replace(specimen, stiffnesses=(1e-9,) * 3, dampings=(0.0,) * 3, lower_gap_m=np.inf, gap_m=SHORT_M)
    step_s = min(method.longest_s, SHORT_M / speed)
    before = np.zeros((PHASES, 6))
    before[:, 1] = SHORT_M - np.linspace(0.0, 1.0, PHASES, endpoint=False) * step_s * speed
    before[:, 4] = speed
    after = textbook_states(free, Harmonic(100.0, 0.0), method, LONG_S, before)
    return np.mean(((after[:, 4] - after[:, 5]) / speed) ** 2)


if __name__ == "__main__":
    main()
