"""The page on accuracy is made from a measurement, and the page in docs was made by this code."""

import runpy
from dataclasses import replace
from pathlib import Path

import pytest

from vibench.analysis.report import tradeoff_figure
from vibench.sim import Accuracy
from vibench.sim.accuracy_benchmark.figures import LOTTERIES, MOTIONS, TRANSIENTS
from vibench.sim.accuracy_benchmark.measuring import Thoroughness, measure_accuracy

ROOT = Path(__file__).parents[3]
PAGE = ROOT / "docs" / "accuracy.md"
accuracy_document = runpy.run_path(str(ROOT / "benchmarks" / "accuracy_page.py"))["accuracy_document"]


@pytest.fixture(scope="module")
def benchmark():
    return measure_accuracy(
        Thoroughness(span_s=0.03, solver_span_s=0.01, starts=8),
        motions=(MOTIONS[1], MOTIONS[-1]),
        lotteries=(LOTTERIES[1],),
        transients=TRANSIENTS[2:3],
    )


def test_the_page_begins_with_its_answer(benchmark):
    for page in (PAGE.read_text(encoding="utf-8"), accuracy_document(benchmark, "x.png")):
        assert page.index("`standard` is the default") < page.index("| level | promised |") < 500
        assert page.index("## How it was measured") < page.index(
            "Made by `python benchmarks/accuracy_page.py`"
        )


def headings(text):
    return [line for line in text.splitlines() if line.startswith(("#", "| level", "| motion"))]


def test_the_page_holds_every_level_and_solver_of_every_motion(benchmark):
    page = accuracy_document(benchmark, "images/tradeoff.png")
    for each in benchmark.motions:
        assert each.motion.name in page
        assert each.advice in page
    assert page.count("| **quick** |") == page.count("; Radau ") == 2
    assert page.count("](images/tradeoff.png)") == 1


def test_the_page_has_the_shares_of_scenes_whose_start_is_forgotten(benchmark):
    page = accuracy_document(benchmark, "x.png")
    (lottery,) = benchmark.lotteries
    rows = [line for line in page.splitlines() if line.startswith(f"| {lottery.lottery.name}")]
    assert len(rows) == len(lottery.answered.ensemble.motions)
    assert all("yes" in row or "**no**" in row for row in rows)
    without = accuracy_document(replace(benchmark, lotteries=()), "x.png")
    assert "start is forgotten" not in without


def test_the_page_says_when_a_promise_is_not_kept(benchmark):
    assert benchmark.worst_error(Accuracy.QUICK) <= Accuracy.QUICK.promise
    assert "**no**" not in accuracy_document(replace(benchmark, lotteries=()), "x.png")


def test_a_transient_errs_by_no_more_than_the_promise_times_its_growth_and_than_its_answer_says(benchmark):
    page = accuracy_document(benchmark, "x.png")
    assert [each.accuracy for each in benchmark.transients] == list(Accuracy)
    for each in benchmark.transients:
        assert each.state_error <= each.promise
        assert each.response_error <= each.stated_error
        assert f"| {each.motion.name} | {each.growth:.0f} | " in page
        state = f"{each.state_error:.1e} ({each.promise:.1e})"
        assert f"{state}; {each.response_error:.1e} ({each.stated_error:.1e})" in page


def test_the_page_names_the_motions_on_which_a_level_buys_nothing(benchmark):
    motion = benchmark.motions[0]
    quick, standard, reference = motion.levels
    stuck = replace(motion, levels=(quick, replace(standard, state_error=quick.state_error), reference))
    named = f"- standard is no better than quick: {motion.motion.name}"
    assert named in accuracy_document(replace(benchmark, motions=(stuck,)), "x.png")
    better = replace(standard, state_error=0.1 * quick.state_error)
    gained = replace(motion, levels=(quick, better, replace(reference, state_error=0.0)))
    assert "is no better" not in accuracy_document(replace(benchmark, motions=(gained,)), "x.png")


def test_the_page_in_docs_has_the_motions_and_columns_that_this_code_writes(benchmark):
    kept = headings(PAGE.read_text(encoding="utf-8"))
    made = headings(accuracy_document(benchmark, "x.png"))
    assert set(made) <= set(kept)
    assert [line for line in kept if line.startswith("## ") and ":" in line] == [
        f"## {each.regime.value.capitalize()}: {each.name}" for each in MOTIONS
    ]


def test_the_figure_draws_every_motion_that_has_an_error(benchmark):
    drawn = tradeoff_figure(benchmark)
    labels = {line.get_label() for line in drawn.figure.axes[0].get_lines()}
    assert benchmark.motions[0].motion.name in labels
    assert benchmark.motions[1].motion.name not in labels
