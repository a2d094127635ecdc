"""Compare cost and error of this engine and of general solvers, on the same motions in one run.

``python benchmarks/work_precision.py --markdown docs/accuracy.md``; peers: ``pip install -e '.[peers]'``
(numbalsoda is built from source and needs a Fortran compiler). A peer that is not installed is omitted,
and the page says so.

Every solver starts in the same settled state. A solver's error is the difference from the independent
solution after 0.2 s (in chaos, 0.03 s). A solver's cost is processor time divided by simulated time, in the
fastest of several runs of 3 s (scipy: 0.3 s), without preparation such as compilation. For the solver heyoka,
"at its best" means equations transformed to suit Taylor series, and "eight at a time" means batch mode, with
the time divided by eight.
"""

import argparse
import importlib.util
import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

import numpy as np
from accuracy_motions import MOTIONS, Regime, settled_state
from independent_solution import Place, independent_state, rates_at, state_error
from scipy.integrate import solve_ivp

from vibench.sim import Accuracy, PowerLaw
from vibench.sim.scene.followed_run import FollowedRun
from vibench.sim.specimen.specimen import Floats

PERIODIC_S, CHAOTIC_S = 0.2, 0.03
"""Spans for errors [s]; in 0.03 s, chaos of 112 per second magnifies an error only by e^3."""
COST_S, SLOW_COST_S = 3.0, 0.3
"""Spans for costs, and for costs of solvers that are a thousand times slower [s]; they are so long that the
overhead of a call is negligible."""
REPEATS = 5
HEADING = "## Other solvers"
TOLERANCES = (1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11)
LOWEST_M = 1e-13
"""Absolute tolerance over the relative one, for solvers that need one."""


@dataclass(frozen=True)
class Work:
    """Cost and error of one solver at one tolerance."""

    solver: str
    tolerance: float
    cost: float
    """Processor time over simulated time."""
    error: float
    """Error of the state, in units of 100 um and 0.1 m/s."""


def main():
    """Measure, print, and write the section if requested."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--markdown", type=Path, help="replace the last section of this page")
    arguments = parser.parse_args()
    curves = {}
    for motion in MOTIONS:
        if motion.regime is Regime.FREE:
            continue
        works = run_solvers(motion)
        curves[motion.name] = works
        print(*table_of({motion.name: works}), sep="\n", flush=True)
    if arguments.markdown:
        write_section(arguments.markdown, curves)


def run_solvers(motion):
    """Run every solver on a motion at every tolerance."""
    span_s = CHAOTIC_S if motion.regime is Regime.CHAOTIC else PERIODIC_S
    span_s = round(span_s * motion.frequency_hz) / motion.frequency_hz
    start = settled_state(motion)
    truth = independent_state(motion.specimen, motion.drive, span_s, start)
    works = []
    for solver in solvers_of(motion):
        for tolerance in [level.tolerance for level in Accuracy] if solver.name == OURS else TOLERANCES:
            end, cost = solver.end(tolerance, start, span_s), least_cost(solver, tolerance, start)
            if is_end(end) and cost is not None:
                works.append(Work(solver.name, tolerance, cost, state_error(end, truth)))
    return works


def is_end(state):
    """Return whether a solver reached the end with a finite state."""
    return state is not None and bool(np.all(np.isfinite(state)))


@dataclass(frozen=True)
class Solver:
    """One solver for one motion."""

    name: str
    end: Callable[[float, Floats, float], Floats | None]
    """Function from tolerance, initial state and span [s] to the final state; None if the solver fails."""
    cost: Callable[[float, Floats, float], float | None]
    """Function from the same to processor time over simulated time; None if the solver fails."""
    cost_s: float = COST_S
    """Simulated time of a run for costs [s]."""


def solver_of(name, prepare, cost_s=COST_S):
    """Return a solver; ``prepare`` returns a job, which returns the final state."""

    def cost(tolerance, start, span_s):
        job = prepare(tolerance, start, span_s)
        before = time.thread_time()
        end = job()
        return (time.thread_time() - before) / span_s if is_end(end) else None

    return Solver(name, lambda *run: prepare(*run)(), cost, cost_s)


def least_cost(solver, tolerance, start):
    """Return the shortest processor time over simulated time; None if the solver fails."""
    best, spent = math.inf, 0.0
    for _ in range(REPEATS):
        cost = solver.cost(tolerance, start, solver.cost_s)
        if cost is None:
            return None
        best, spent = min(best, cost), spent + cost * solver.cost_s
        if spent > 2.0:
            break
    return best


OURS = "vibench"


def solvers_of(motion):
    """Yield every solver for a motion."""
    yield solver_of(OURS, lambda tolerance, start, span_s: run_vibench(motion, tolerance, start, span_s))
    for method in ("DOP853", "LSODA"):
        yield solver_of(f"scipy {method}", lambda *run, m=method: with_scipy(motion, m, *run), SLOW_COST_S)
    if importlib.util.find_spec("numbalsoda"):
        for method in ("lsoda", "dop853"):
            yield solver_of(f"numbalsoda {method}", lambda *run, m=method: with_numbalsoda(motion, m, *run))
    if importlib.util.find_spec("heyoka"):
        from heyoka_peers import LANES, AtHome, plain  # noqa: PLC0415 - only where the peer is there

        constants, best = constants_of(motion), AtHome(constants_of(motion))
        yield solver_of("heyoka, plain equations", lambda *run: plain(constants, *run))
        for lanes, how in ((1, "one at a time"), (LANES, "eight at a time")):
            yield Solver(
                f"heyoka, at its best, {how}", best.end, lambda *run, count=lanes: best.cost(count, *run)
            )


def run_vibench(motion, tolerance, start, span_s):
    """Prepare a run of this engine; return the job."""
    run = FollowedRun(motion.specimen, motion.drive, tolerance, start)

    def job():
        run.follow(span_s)
        return run.motion

    return job


def with_scipy(motion, method, tolerance, start, span_s):
    """Prepare a run of scipy's solve_ivp; return the job."""
    rates = rates_at(Place.ANYWHERE, motion.specimen, motion.drive)
    rates(0.0, start)

    def job():
        found = solve_ivp(
            rates,
            (0.0, span_s),
            start,
            method=method,
            rtol=tolerance,
            atol=tolerance * LOWEST_M,
            t_eval=[span_s],
        )
        return found.y[:, -1] if found.success else None

    return job


_numbalsoda_address = []


def plain_function():
    """Return the address of the plain equations for numbalsoda; they are compiled once."""
    if not _numbalsoda_address:
        from numba import cfunc  # noqa: PLC0415 - only where the peer is there
        from numbalsoda import lsoda_sig  # noqa: PLC0415

        @cfunc(lsoda_sig)
        def rates(t, u, du, q):
            """Compute du; q as returned by `constants_of`."""
            x, y, z, vx, vy, vz = u[0], u[1], u[2], u[3], u[4], u[5]
            base, base_rate = q[9] * np.sin(q[10] * t), q[9] * q[10] * np.cos(q[10] * t)
            p = y - z
            push = 0.0
            if q[12] > 0.0 and abs(p) > q[11]:
                push = math.copysign(q[12] * (abs(p) - q[11]) ** q[13], p)
            if q[15] > 0.0:
                push += q[15] * (p / q[16]) ** int(q[14])
            inner = q[4] * p + q[7] * (vy - vz) + push
            outer = q[5] * (z - x) + q[8] * (vz - vx)
            du[0], du[1], du[2] = vx, vy, vz
            du[3] = (outer + q[3] * (base - x) + q[6] * (base_rate - vx)) / q[0]
            du[4] = -inner / q[1]
            du[5] = (inner - outer) / q[2]

        _numbalsoda_address.append(rates)
    return _numbalsoda_address[0].address


def constants_of(motion):
    """Return masses, stiffnesses, dampings, A0, omega, gap, stiffness, exponent, n, force and p_ref."""
    specimen, drive = motion.specimen, motion.drive
    stiffness, exponent = 0.0, 1.0
    power, force, reference = 0.0, 0.0, 1.0
    if isinstance(specimen.contact, PowerLaw):
        ((power, force),) = specimen.contact.terms
        reference = specimen.contact.reference
    else:
        stiffness, exponent = specimen.contact.stops.term
    linear = [*specimen.masses, *specimen.stiffnesses, *specimen.dampings]
    driven = [drive.amplitude_m, 2.0 * math.pi * drive.frequency_hz]
    return np.array([*linear, *driven, min(specimen.gaps_m), stiffness, exponent, power, force, reference])


def with_numbalsoda(motion, method, tolerance, start, span_s):
    """Prepare a run of LSODA in C++ or DOP853 in Fortran, by numbalsoda; return the job."""
    import numbalsoda  # noqa: PLC0415 - only where the peer is there

    solve, address, constants = getattr(numbalsoda, method), plain_function(), constants_of(motion)
    times = np.array([0.0, span_s])
    options = {"rtol": tolerance, "atol": tolerance * LOWEST_M, "mxstep": 10_000_000}

    def job():
        found, success = solve(address, start, times, constants, **options)
        return found[-1] if success else None

    return job


def cost_at(works, error):
    """Return the cost of a solver at an error, interpolated in logarithms; None below its smallest error."""
    front, best = [], math.inf
    for work in sorted(works, key=lambda each: each.error):
        if work.cost < best:
            front.append(work)
            best = work.cost
    if not front or error < front[0].error:
        return None
    errors, costs = ([math.log(getattr(work, name)) for work in front] for name in ("error", "cost"))
    return math.exp(np.interp(math.log(error), errors, costs))


def table_of(curves):
    """Yield a table of the cost of every solver at the error of our standard level, by motion."""
    level = Accuracy.STANDARD
    ours = {
        name: next(work for work in works if work.solver == OURS and work.tolerance == level.tolerance)
        for name, works in curves.items()
    }
    yield f"| solver | {' | '.join(curves)} |"
    yield f"|{'---|' * (1 + len(curves))}"
    cells = (f"{1.0 / each.cost:.0f} s per s ({each.error:.1e})" for each in ours.values())
    yield f"| vibench, {level} | {' | '.join(cells)} |"
    solvers = dict.fromkeys(work.solver for works in curves.values() for work in works)
    for solver in (each for each in solvers if each != OURS):
        cells = []
        for name, works in curves.items():
            its = [work for work in works if work.solver == solver]
            equal = cost_at(its, ours[name].error)
            usual = next((work for work in its if work.tolerance == 1e-6), None)
            same, at_usual = "never" if equal is None else f"{equal / ours[name].cost:.3g}", "gave up"
            if usual is not None:
                at_usual = f"{usual.cost / ours[name].cost:.3g} ({usual.error:.1e})"
            cells.append(f"{same}; {at_usual}")
        yield f"| {solver} | {' | '.join(cells)} |"


def write_section(page, curves):
    """Replace the last section of the page by these tables, and draw the curves."""
    missing = [name for name in ("numbalsoda", "heyoka") if not importlib.util.find_spec(name)]
    absent = f" Not installed: {', '.join(missing)}." if missing else ""
    lines = (
        HEADING,
        "",
        __doc__.split("\n\n", 2)[2].strip(),
        "",
        f"Measured with vibench {version('vibench')}.{absent}",
        "",
        "First row: seconds that vibench simulates per second (error in brackets). Other cells:",
        "",
        "1. the solver's time divided by vibench's time for the same error (`never`: error not reached);",
        "2. the same ratio at a solver tolerance of 1e-6 (`gave up`: the solver failed);",
        "3. in brackets, the solver's error at this tolerance.",
        "",
        "![Error over cost of each solver](images/work_precision.png)",
        "",
        *table_of(curves),
    )
    before = page.read_text(encoding="utf-8").split(f"\n{HEADING}\n")[0]
    page.write_text(before + "\n" + "\n".join(lines) + "\n", encoding="utf-8")
    draw(page.parent / "images" / "work_precision.png", curves)


def draw(path, curves):
    """Draw error over cost, one panel for each motion."""
    import matplotlib as mpl  # noqa: PLC0415 - slow to load, and needed only here

    mpl.use("Agg")
    from matplotlib import pyplot as plt  # noqa: PLC0415

    figure, panels = plt.subplots(2, 3, figsize=(12, 7), layout="constrained", sharex=True, sharey=True)
    for panel, (name, works) in zip(panels.flat, curves.items(), strict=True):
        for solver in dict.fromkeys(work.solver for work in works):
            its = [work for work in works if work.solver == solver]
            thick = 2.5 if solver == OURS else 1.0
            panel.loglog([w.cost for w in its], [w.error for w in its], "o-", label=solver, lw=thick, ms=3)
        panel.set_title(name, fontsize=9)
        panel.grid(visible=True, which="major", alpha=0.3)
    for panel in panels[-1]:
        panel.set_xlabel("processor time per simulated time")
    for panel in panels[:, 0]:
        panel.set_ylabel("error of the state")
    panels.flat[0].legend(fontsize=8)
    figure.savefig(path, dpi=130)


if __name__ == "__main__":
    main()
