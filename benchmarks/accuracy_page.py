"""Write docs/accuracy.md: cost and error of each accuracy level, from one measurement.

``python benchmarks/accuracy_page.py``; then `work_precision.py` and `error_targets.py` add their sections.
"""

import argparse
import json
from collections.abc import Iterator
from itertools import groupby
from pathlib import Path

from accuracy_motions import (
    AccuracyBenchmark,
    LevelFigures,
    LotteryFigures,
    MotionBenchmark,
    StatedShare,
    Thoroughness,
    TransientFigures,
    measure_accuracy,
)

from vibench.sim import Accuracy

_HEAD = "| level | speed [s/s] | state error | Response I error | Response II error | exponent [1/s] |"
_RULE = "|---|---|---|---|---|---|"
_LOTTERY_HEAD = (
    "| case | motion | Response I | relative error | predicted share | share in further runs | in interval "
    "| chaos ends at the rate [1/s] | relative time |"
)
ABSENT = "–"


def accuracy_document(benchmark: AccuracyBenchmark) -> str:
    """Return the text of the page."""
    return "\n".join(_lines(benchmark)) + "\n"


def _lines(benchmark: AccuracyBenchmark) -> Iterator[str]:
    *others, last = (f"{each.promise:.0e} ({each})" for each in Accuracy)
    yield from (
        "# Speed and accuracy",
        "",
        "`standard` is the default accuracy level of a simulation. Use `quick` for a first look, and",
        "`reference` to check a result. In a periodic motion, the error of the state is at most",
        f"{', '.join(others)} or {last}, in units of 100 µm for",
        "displacements and 0.1 m/s for velocities. In chaos, no accuracy level predicts a single motion;",
        "only averages are meaningful.",
    )
    yield from _promises(benchmark)
    first, software = benchmark.motions[0], json.loads(benchmark.software)
    yield from (
        "",
        "## How it was measured",
        "",
        "`python benchmarks/accuracy_page.py`, then `error_curves.py`, `error_targets.py` and",
        "`work_precision.py` make this page; do not edit it by hand.",
        f"The tables below (vibench {software['vibench']}; {benchmark.machine}) show:",
        "",
        "- speed: duration of motion that one core simulates in a second [s];",
        "- state error: the largest error of the six components of the state, in the units above, relative",
        "  to an independent solution (scipy's DOP853 with tolerance 1e-12, restarted at every contact);",
        "- Response I and II errors: relative differences from level `reference`;",
        "- the largest Lyapunov exponent, with its standard error.",
        "",
        f"States are compared after {first.span_s:.3g} s.",
    )
    for each in benchmark.motions:
        yield from _motion(each)
    yield from _share_section(benchmark.lotteries)
    yield from _transients(benchmark.transients)


def _share_section(lotteries: tuple[LotteryFigures, ...]) -> Iterator[str]:
    """Yield the section that compares stated shares with the shares of many initial states."""
    if not lotteries:
        return
    yield from (
        "",
        "## Sensitive dependence on the start",
        "",
        "In the cases below, a tiny change of the initial conditions (the *start*) may lead to another final",
        "motion. The table compares the predicted share of starts that reach each motion with the share in",
        f"{lotteries[0].starts} further runs, whose starts differ by a millionth of the gap.",
        "`periodic, 1` is a motion that repeats after one drive period. In 19 of 20 predictions, all",
        "intervals contain the true shares. *Relative time* is the computing time divided by a",
        "single run's time.",
        "",
        _LOTTERY_HEAD,
        "|---|---|---|---|---|---|---|---|---|",
    )
    for each in lotteries:
        for stated in each.shares:
            yield _share(each, stated)


def _share(found: LotteryFigures, stated: StatedShare) -> str:
    motion, share = stated.motion, stated.motion.share
    escape = None if found.prediction.ensemble is None else found.prediction.ensemble.escape
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
        "In a transient, a small error may grow a thousandfold. The promised state error is the promise for",
        "periodic motion, multiplied by this growth. Each cell has four numbers:",
        "",
        "1. state error after 0.1 s, against the independent solution;",
        "2. in brackets, the promised state error;",
        "3. relative difference of the Responses (second half of the run) from level `reference`;",
        "4. in brackets, the stated error of these Responses, from a stricter run.",
        "",
        f"| motion | growth of a small error | {' | '.join(Accuracy)} |",
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
        found.advice,
        "",
        _HEAD,
        _RULE,
    )
    for level in found.levels:
        yield _level(level)


def _level(level: LevelFigures) -> str:
    first = _number(level.response_i_error)
    if level.response_i_scatter > 0.0:
        first = f"scatter {level.response_i_scatter:.1%}"
    exponent = f"{level.exponent_per_s:.4g} ± {level.exponent_error_per_s:.1g}"
    cells = (_number(level.state_error), first, _number(level.response_ii_error), exponent)
    return f"| **{level.accuracy.value}** | {1 / level.cost:.0f} | {' | '.join(cells)} |"


def _number(value: float | None) -> str:
    return ABSENT if value is None else f"{value:.1e}"


def _promises(benchmark: AccuracyBenchmark) -> Iterator[str]:
    yield from (
        "",
        "## Promised and measured errors",
        "",
        "Errors of the state without contact and in periodic motion:",
        "",
        "| level | promised | largest measured | within the promise |",
        "|---|---|---|---|",
    )
    for accuracy in Accuracy:
        worst = benchmark.worst_error(accuracy)
        kept = "yes" if worst <= accuracy.promise else "**no**"
        yield f"| {accuracy.value} | {accuracy.promise:.0e} | {worst:.1e} | {kept} |"


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
