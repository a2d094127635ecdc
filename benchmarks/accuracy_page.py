"""Write docs/accuracy.md: cost and error of each accuracy level, from one measurement.

``python benchmarks/accuracy_page.py``; then `work_precision.py` and `error_targets.py` add their sections.
"""

import argparse
import json
from collections.abc import Iterator
from itertools import groupby
from pathlib import Path

from accuracy_motions import (
    LEAST_GAIN,
    AccuracyBenchmark,
    LevelFigures,
    LotteryFigures,
    MotionBenchmark,
    SolverFigures,
    StatedShare,
    Thoroughness,
    TransientFigures,
    measure_accuracy,
)

from vibench.sim import Accuracy

_HEAD = "| level | simulated s per s | error of the state | of Response I | of Response II | exponent [1/s] |"
_RULE = "|---|---|---|---|---|---|"
_LOTTERY_HEAD = (
    "| scene | motion | Response I | error | predicted share | share found | covered "
    "| chaos dies out [1/s] | cost |"
)
ABSENT = "–"


def accuracy_document(benchmark: AccuracyBenchmark) -> str:
    """Return the text of the page."""
    return "\n".join(_lines(benchmark)) + "\n"


def _lines(benchmark: AccuracyBenchmark) -> Iterator[str]:
    yield from (
        "# Speed and accuracy",
        "",
        "`standard` is the default. Use `quick` for a first look, and `reference` to check a result.",
        f"A periodic motion is correct to {', '.join(f'{each.promise:.0e} ({each})' for each in Accuracy)}.",
        "In chaos no level predicts a single motion; only averages are meaningful.",
    )
    yield from _promises(benchmark)
    yield from (
        "",
        "## How it was measured",
        "",
        "Made by `python benchmarks/accuracy_page.py`, and not edited by hand. Three scripts add their",
        "sections: `python benchmarks/error_curves.py` the cost of a target, `python",
        "benchmarks/work_precision.py --markdown docs/accuracy.md` other solvers, and `python",
        "benchmarks/error_targets.py --sum FILE --markdown docs/accuracy.md` requested errors.",
        f"Machine: {benchmark.machine}; vibench {json.loads(benchmark.software)['vibench']}.",
        "",
        "An error of the state is the largest of six components, in units of 100 µm and 0.1 m/s, compared",
        "with an independent solution (scipy's DOP853 at 1e-12, restarted at every contact). Errors of the",
        "responses are relative to the reference level. scipy's solvers have a relative tolerance of 1e-6;",
        "their numbers are simulated seconds per second and the error of the state. Times are for one",
        "core.",
    )
    for each in benchmark.motions:
        yield from _motion(each)
    yield from _lotteries(benchmark.lotteries)
    yield from _transients(benchmark.transients)


def _lotteries(lotteries: tuple[LotteryFigures, ...]) -> Iterator[str]:
    """Yield the section on stated shares, beside the shares of many starts."""
    if not lotteries:
        return
    yield from (
        "",
        "## Sensitive dependence on the start",
        "",
        f"Each scene is simulated until it settles, and from {lotteries[0].starts} further starts, a",
        "millionth of the gap apart, for at most 300 s. A chaotic or undecided motion may still change.",
        "All intervals of shares hold together in 19 of 20 cases, also if a motion changes later. Cost is",
        "the time of the whole prediction divided by the time of one run.",
        "",
        _LOTTERY_HEAD,
        "|---|---|---|---|---|---|---|---|---|",
    )
    for each in lotteries:
        for stated in each.shares:
            yield _share(each, stated)


def _share(found: LotteryFigures, stated: StatedShare) -> str:
    motion, share = stated.motion, stated.motion.share
    escape = None if found.answered.ensemble is None else found.answered.ensemble.escape
    cells = (
        f"{found.lottery.name}: {found.lottery.about}",
        f"{motion.motion}" + ("" if motion.period is None else f", {motion.period}"),
        f"{motion.response_i:.4g}",
        _number(motion.error_estimate),
        f"{share.share:.0%} ({100 * share.low:.0f} to {100 * share.high:.0f} %)",
        f"{stated.of_many:.0%}",
        "yes" if stated.is_covered else "**no**",
        ABSENT
        if escape is None
        else f"{escape.rate_per_s:.2g} ({escape.low_per_s:.2g} to {escape.high_per_s:.2g})",
        f"{found.cost:.1f}",
    )
    return f"| {' | '.join(cells)} |"


def _transients(transients: tuple[TransientFigures, ...]) -> Iterator[str]:
    """Yield the section on the errors of each level in transients."""
    if not transients:
        return
    yield from (
        "",
        "## Transients, from rest",
        "",
        "In a settled motion, integration errors decay; in a transient a small error may grow a",
        "thousandfold. Each level promises the settled error above times the largest growth. The stated",
        "error of the responses comes from a stricter run from the same start. The state is compared after",
        "0.1 s with the independent solution, the responses of the second half with the reference level.",
        "Each cell has the error of the state (promised), then the error of the responses (stated).",
        "",
        f"| motion | growth | {' | '.join(Accuracy)} |",
        "|---|---|---|---|---|",
    )
    for name, group in groupby(transients, key=lambda each: each.motion.name):
        levels = tuple(group)
        cells = " | ".join(map(_transient, levels))
        yield f"| {name} | {levels[0].growth:.0f} | {cells} |"


def _transient(level: TransientFigures) -> str:
    state = f"{level.state_error:.1e} ({level.promise:.1e})"
    return f"{state}; {level.response_error:.1e} ({level.stated_error:.1e})"


def _motion(found: MotionBenchmark) -> Iterator[str]:
    yield from (
        "",
        f"## {found.motion.regime.value.capitalize()}: {found.motion.name}",
        "",
        f"State compared after {found.span_s:.3g} s. {found.advice}",
        "",
        _HEAD,
        _RULE,
    )
    for level in found.levels:
        yield _level(level)
    solvers = "; ".join(map(_solver, found.solvers))
    yield from ("", f"scipy, compared after {found.solver_span_s:.3g} s: {solvers}.")


def _level(level: LevelFigures) -> str:
    first = _number(level.response_i_error)
    if level.response_i_scatter > 0.0:
        first = f"scatter {level.response_i_scatter:.1%}"
    exponent = f"{level.exponent_per_s:.4g} ± {level.exponent_error_per_s:.1g}"
    cells = (_number(level.state_error), first, _number(level.response_ii_error), exponent)
    return f"| **{level.accuracy.value}** | {1 / level.cost:.0f} | {' | '.join(cells)} |"


def _solver(solver: SolverFigures) -> str:
    error = "" if solver.state_error is None else f" ({_number(solver.state_error)})"
    return f"{solver.name} {1 / solver.cost:.2g}{error}"


def _number(value: float | None) -> str:
    return ABSENT if value is None else f"{value:.1e}"


def _promises(benchmark: AccuracyBenchmark) -> Iterator[str]:
    yield from ("", "## Promises", "", "| level | promised | worst found | kept |", "|---|---|---|---|")
    for accuracy in Accuracy:
        worst = benchmark.worst_error(accuracy)
        kept = "yes" if worst <= accuracy.promise else "**no**"
        yield f"| {accuracy.value} | {accuracy.promise:.0e} | {worst:.1e} | {kept} |"
    # Name the motions on which a level does not reduce the error.
    names: dict[str, list[str]] = {}
    for each in benchmark.motions:
        for level, before in each.without_gain:
            pair = f"{level.accuracy.value} is no better than {before.accuracy.value}"
            names.setdefault(pair, []).append(each.motion.name)
    if names:
        lines = (f"- {pair}: {'; '.join(motions)}" for pair, motions in names.items())
        yield from ("", f"Levels that reduce an error by less than a factor of {LEAST_GAIN:g}:", "", *lines)


def main() -> None:
    """Run the measurement and write the page."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--markdown", type=Path, default=Path("docs/accuracy.md"))
    parser.add_argument("--span", type=float, default=2.0, help="length of the motion compared [s]")
    given = parser.parse_args()
    benchmark = measure_accuracy(Thoroughness(span_s=given.span), print)
    given.markdown.write_text(accuracy_document(benchmark), encoding="utf-8")


if __name__ == "__main__":
    main()
