"""Measure the cost of a target error: three figures and the first section of docs/accuracy.md.

``python benchmarks/error_curves.py --markdown docs/accuracy.md`` draws three figures: error over time for the
paper's four cases; similarity of continuous models over their computing time; error of a mean in chaos over
window and number of initial states. Times are processor time of one core. Numbers stored in images/NAME.csv
are used again; remove the file to measure again.
"""

import argparse
import csv
import json
import time
from itertools import cycle
from pathlib import Path

import numpy as np

from vibench.analysis import SimilarityCurve, similarity
from vibench.analysis.report import (
    LEVEL_STYLES,
    LEVELS,
    DrawnFigure,
    ImageKind,
    curve_figure,
    figure_style,
    legend_above,
    new_figure,
    table,
)
from vibench.sim import Accuracy, Harmonic, Scene, Target, gong2025, solve_scene
from vibench.sim.accuracy_benchmark import CurvePoint, scene_curve
from vibench.sim.engine.run import Watch
from vibench.sim.scene.followed_run import FollowedRun
from vibench.sim.scene.mean_of_starts import mean_error
from vibench.sim.scene.several_starts import SEED, pushes
from vibench.sim.study import software

PAPER_HZ, AMPLITUDES_M = 260.0, (1e-6, 5e-6, 10e-6, 50e-6)
ORDERS = ("3", "5", "7", "13", "21", "29", "47", "3+5", "3+5+7")
GRID_HZ = np.arange(20.0, 501.0, 20.0)
WINDOWS_S = (0.5, 1.0, 2.0, 5.0)
LABELLED_M = 10e-6
LEAD_S, STARTS = 3.0, 64
COUNTS = (2, 4, 8, 16, 32, STARTS)
PICTURES = ("tradeoff", "model_similarity", "chaos_error")
HEADING, NEXT = "## What a target costs", "## Promised and measured errors"


def paper_cases():
    """Measure error over time of every method for the paper's four cases."""
    found = {}
    for amplitude_m in AMPLITUDES_M:
        scene = Scene(gong2025(), Harmonic(PAPER_HZ, amplitude_m), target=Target(error=0.01))
        name = f"hertz, {PAPER_HZ:g} Hz, {1e6 * amplitude_m:g} µm"
        found[name] = list(scene_curve(scene))
    return found


def stored_rows(path):
    """Return the rows of a stored table, with numbers converted; None if there is no file."""
    if not path.exists():
        return None
    with path.open(encoding="utf-8", newline="") as file:
        lines = [line for line in file if not line.startswith("#")]
    _, *rows = csv.reader(lines)
    return [[_number(cell) for cell in row] for row in rows]


def _number(cell):
    try:
        return float(cell)
    except ValueError:
        return cell


def stored_curves(rows):
    """Return curves from the rows of their table."""
    found = {}
    for scene, method, time_s, error, is_stated, is_chosen in rows:
        point = CurvePoint(method, time_s, error, np.nan, np.nan, bool(is_stated), bool(is_chosen))
        found.setdefault(scene, []).append(point)
    return found


def response_curve(model, amplitude_m):
    """Return Response I over the grid, and the mean processor time of a point [s]."""
    seen = []
    began_s = time.process_time()
    for frequency_hz in GRID_HZ:
        drive = Harmonic(float(frequency_hz), amplitude_m)
        scene = Scene(gong2025(contact=model), drive, accuracy=Accuracy.QUICK, budget_s=0.0)
        seen.append(solve_scene(scene, "motion").response_i)
    return np.array(seen, dtype=np.float64), (time.process_time() - began_s) / len(GRID_HZ)


def models_of_stops():
    """Return the similarity of continuous models and stops: model, amplitude, time per point, similarity."""
    rows = []
    for amplitude_m in AMPLITUDES_M:
        stops, cost_s = response_curve("hertz", amplitude_m)
        rows.append(("hertz", amplitude_m, cost_s, 1.0, 1.0, 1.0))
        for order in ORDERS:
            values, cost_s = response_curve(f"power:{order}", amplitude_m)
            pair = (SimilarityCurve(GRID_HZ, each, amplitude_m) for each in (stops, values))
            alike = similarity(*pair)
            rows.append((f"n = {order}", amplitude_m, cost_s, alike.rate, alike.low, alike.high))
    return rows


def models_figure(rows):
    """Draw the similarity of Response I over the time per point, with one marker style per level."""
    with figure_style():
        figure = new_figure(4.2)
        axes = figure.subplots()
        for amplitude_m, colour in zip(AMPLITUDES_M, LEVELS, strict=False):
            own = [row for row in rows if row[1] == amplitude_m]
            axes.plot(
                [1e3 * row[2] for row in own],
                [100.0 * row[3] for row in own],
                color=colour,
                linestyle="none",
                marker="osD^"[AMPLITUDES_M.index(amplitude_m)],
                markersize=4,
                label=f"{1e6 * amplitude_m:g} µm",
            )
        labelled = sorted((row for row in rows if row[1] == LABELLED_M), key=lambda row: row[2])
        for name, _, cost_s, rate, *_ in labelled:
            alike = [row[2] for row in labelled if row[3] == rate]
            # Among models of equal similarity, label the fastest on the left and the slowest on the right.
            is_first = cost_s == alike[0] and (len(alike) > 1 or cost_s == labelled[0][2])
            side = -1 if is_first else 1 if cost_s == alike[-1] else 0
            axes.annotate(
                name,
                (1e3 * cost_s, 100.0 * rate),
                textcoords="offset points",
                xytext=(6 * side, -2 if side else 5),
                ha=("center", "left", "right")[side],
                fontsize=7,
            )
        axes.set_xscale("log")
        axes.set_xlabel("processor time of a point [ms]")
        axes.set_ylabel("similar frequencies R [%]")
        legend_above(figure, [axes], columns=4)
    names, levels, costs, rates, lows, highs = zip(*rows, strict=True)
    return DrawnFigure(
        "model_similarity",
        "Similarity of continuous models over their cost",
        "Similarity of Response I with the piece-wise model, over the processor time of a point.",
        figure,
        (
            table(
                "model_similarity",
                model=np.array(names),
                amplitude_m=np.array(levels),
                point_s=np.array(costs),
                rate=np.array(rates),
                low=np.array(lows),
                high=np.array(highs),
            ),
        ),
    )


def chaos_rows():
    """Return the stated error of the mean in chaos: rows of window, number of initial states, error, time."""
    drive, rows = Harmonic(PAPER_HZ, AMPLITUDES_M[1]), []
    specimen = gong2025()
    for window_s in WINDOWS_S:
        seen, costs_s = [], []
        for push in pushes(specimen, drive, STARTS, SEED):
            began_s = time.process_time()
            run = FollowedRun(specimen, drive, Accuracy.QUICK.tolerance, push)
            run.follow(LEAD_S)
            part = run.follow(LEAD_S + window_s, Watch.PEAKS_AND_LINES)
            costs_s.append(time.process_time() - began_s)
            lines = (2.0 * abs(area) / window_s for area in (part.area_x, part.area_p))
            line_x, line_p = lines
            seen.append(np.array([part.peak_x_m, line_x, part.peak_p_m, line_p]))
        for count in COUNTS:
            error = float(mean_error(seen[:count], None).max())
            rows.append((window_s, count, error, float(np.sum(costs_s[:count]))))
    return rows


def chaos_figure(rows):
    """Draw the error of the mean over computing time, with one line per window."""
    with figure_style():
        figure = new_figure(3.8)
        axes = figure.subplots()
        for window_s, colour, line in zip(WINDOWS_S, cycle(LEVELS), cycle(LEVEL_STYLES), strict=False):
            own = [row for row in rows if row[0] == window_s]
            label = f"window {window_s:g} s"
            axes.plot([row[3] for row in own], [row[2] for row in own], color=colour, linestyle=line,
                      marker="o", markersize=4, label=label)  # fmt: skip
        for _, count, error, cost_s in (row for row in rows if row[0] == WINDOWS_S[-1]):
            axes.annotate(
                f"{count:g} starts",
                (cost_s, error),
                textcoords="offset points",
                xytext=(-3, -9),
                ha="right",
                fontsize=7,
            )
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.set_xlabel("processor time [s]")
        axes.set_ylabel("relative error of the mean")
        legend_above(figure, [axes], columns=4)
    windows, starts, errors, costs = zip(*rows, strict=True)
    return DrawnFigure(
        "chaos_error",
        "Error of a mean over starts in chaos",
        "Largest stated error of the four mean responses over processor time, by window and starts.",
        figure,
        (
            table(
                "chaos_error",
                window_s=np.array(windows),
                starts=np.array(starts),
                error=np.array(errors),
                time_s=np.array(costs),
            ),
        ),
    )


def section(curves, models, chaos):
    """Yield the lines of the section, with three figures and three short tables."""
    yield from (
        HEADING,
        "",
        "Give a target for the relative error of the responses (below 100 %), a time limit, or both:",
        "`vibench predict --amplitude 5e-6 --frequency 260 --error 1% --time 2s`. Target and time apply to",
        "each frequency. The result states the relative error reached; if the target is missed, also the",
        "time needed, if known (exit code 0).",
        f"Tables and pictures are from vibench {json.loads(software())['vibench']};",
        "times are processor times of one core.",
        "",
        "![Error over processor time of every method](images/tradeoff.png)",
        "",
        "`vibench tradeoff --out DIR` draws this picture on your machine.",
        "",
        "- Newton's iteration finds stable periodic motions; a smaller target takes no longer.",
        "- In chaos, the result is a mean over runs from different initial conditions (*starts*). In 19 of",
        "  20 cases, other starts change this mean by at most the stated error, which no accuracy level",
        "  reduces. The stated error does not include motions that no start has reached: with n starts, a",
        "  motion reached by 3/n of all starts is missed in 1 of 20 cases. A single run may differ far more.",
        "",
        (
            "| contact law, drive | target error | stated error | time "
            "| stated error of a 30 s run at `standard` | time of this run |"
        ),
        "|---|---|---|---|---|---|",
    )
    for name, points in curves.items():
        chosen = next(each for each in points if each.is_chosen)
        usual = next((each for each in points if each.method == f"30 s, {Accuracy.STANDARD}"), None)
        rest = "| | |" if usual is None else f"| {usual.error:.1e} | {usual.time_s:.2g} s |"
        yield f"| {name} | 1 % | {chosen.error:.1e} | {chosen.time_s:.2g} s {rest}"
    yield from (
        "",
        "![Similarity R of continuous models and stops, over processor time](images/model_similarity.png)",
        "",
        "The paper replaces the stops (`hertz`) by forces proportional to p^n with odd n (`power:n`; `3+5`",
        "is a sum); p is m1's displacement relative to m2. R is the share of frequencies",
        f"({GRID_HZ[0]:g} to {GRID_HZ[-1]:g} Hz in steps of 20 Hz) at which a model and the stops agree in",
        "Response I (eqs. 6 and 7). Each run is 30 s from rest.",
        "",
        "Up to 10 µm, `hertz` is faster than the continuous models. At 50 µm, models of low order are faster",
        "than `hertz`, but agree less often.",
        "",
        "| model | mean time per frequency | "
        + " | ".join(f"R at {1e6 * amplitude_m:g} µm" for amplitude_m in AMPLITUDES_M)
        + " |",
        "|---|---|" + "---|" * len(AMPLITUDES_M),
    )
    for name in dict.fromkeys(row[0] for row in models):
        own = [row for row in models if row[0] == name]
        rates = " | ".join(f"{row[3]:.0%}" for row in own)
        yield f"| {name} | {1e3 * np.mean([row[2] for row in own]):.1f} ms | {rates} |"
    yield from (
        "",
        "![Stated error over processor time, by window and number of starts](images/chaos_error.png)",
        "",
        f"The table is for chaos at {PAPER_HZ:g} Hz and 5 µm after {LEAD_S:g} s of settling. Each cell shows",
        "the largest stated error of the four responses (I and II of m0 and p), and the processor time.",
        "",
        "- The stated error falls with the square root of the number of starts.",
        "- Windows far shorter than the settling time take more time, because every run must settle first.",
        "- Response I is the largest value in the window, so it depends on `--window` (default 5 s).",
        "- Figure 3 of the paper at 1 % (240 points) needs 250,000 s of simulated motion. 13 points take two",
        "  thirds of the time, with up to 5400 starts. At most of these points, responses differ by up to",
        "  40 % between starts, often because chaos ends randomly.",
        "",
        "| window | " + " | ".join(f"{count} starts" for count in COUNTS) + " |",
        "|---|" + "---|" * len(COUNTS),
    )
    for window_s in WINDOWS_S:
        own = " | ".join(f"{row[2]:.1%} in {row[3]:.2g} s" for row in chaos if row[0] == window_s)
        yield f"| {window_s:g} s | {own} |"
    yield ""


def main():
    """Measure, draw, and insert the section before the promised errors of the page."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--markdown", type=Path, default=Path("docs/accuracy.md"))
    given = parser.parse_args()
    images = given.markdown.parent / "images"
    curves, models, chaos = (stored_rows(images / f"{name}.csv") for name in PICTURES)
    curves = paper_cases() if curves is None else stored_curves(curves)
    models, chaos = models or models_of_stops(), chaos or chaos_rows()
    drawn = curve_figure(curves)
    for figure in (drawn, models_figure(models), chaos_figure(chaos)):
        figure.save(images, (ImageKind.PNG,))
    page = given.markdown.read_text(encoding="utf-8")
    before, after = page.split(f"{NEXT}\n")
    before = before.split(f"{HEADING}\n")[0]
    text = "\n".join(section(curves, models, chaos))
    given.markdown.write_text(f"{before}{text}\n{NEXT}\n{after}", encoding="utf-8")


if __name__ == "__main__":
    main()
