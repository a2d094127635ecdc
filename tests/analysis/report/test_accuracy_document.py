"""The accuracy page follows from a measurement, and the page in docs matches the current code."""

import runpy
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from benchmarks.accuracy_motions import LOTTERIES, MOTIONS, TRANSIENTS, Thoroughness, measure_accuracy
from vibench.sim import Accuracy

ROOT = Path(__file__).parents[3]
PAGE = ROOT / "docs" / "accuracy.md"


@pytest.fixture(scope="module")
def page_of():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "path", [str(ROOT / "benchmarks"), *sys.path])
        return runpy.run_path(str(ROOT / "benchmarks" / "accuracy_page.py"))["accuracy_document"]


@pytest.fixture(scope="module")
def benchmark():
    return measure_accuracy(
        Thoroughness(span_s=0.03, starts=8),
        motions=(MOTIONS[1], MOTIONS[-1]),
        lotteries=(LOTTERIES[1],),
        transients=TRANSIENTS[2:3],
    )


@pytest.mark.thorough
def test_the_accuracy_page_begins_with_its_conclusion(benchmark, page_of):
    for page in (PAGE.read_text(encoding="utf-8"), page_of(benchmark)):
        assert page.index("`standard` is the default") < 100 < page.index("| level | promised |")
        assert page.index("## How it was measured") < page.index("`python benchmarks/accuracy_page.py`")


def headings(text):
    return [line for line in text.splitlines() if line.startswith(("#", "| level", "| motion"))]


@pytest.mark.thorough
def test_the_accuracy_page_lists_every_accuracy_level_for_every_motion(benchmark, page_of):
    page = page_of(benchmark)
    for each in benchmark.motions:
        assert each.motion.name in page
        assert each.advice in page
    assert page.count("| **quick** |") == 2


def test_the_accuracy_page_lists_shares_of_start_dependent_motions(benchmark, page_of):
    page = page_of(benchmark)
    (lottery,) = benchmark.lotteries
    rows = [line for line in page.splitlines() if line.startswith(f"| {lottery.lottery.name}")]
    assert len(rows) == len(lottery.prediction.ensemble.motions)
    assert all("yes" in row or "**no**" in row for row in rows)
    without = page_of(replace(benchmark, lotteries=()))
    assert "Sensitive dependence" not in without


def test_the_accuracy_page_reports_a_missed_accuracy(benchmark, page_of):
    assert benchmark.worst_error(Accuracy.QUICK) <= Accuracy.QUICK.promise
    assert "**no**" not in page_of(replace(benchmark, lotteries=()))


def test_transient_errors_are_within_their_stated_bounds(benchmark, page_of):
    page = page_of(benchmark)
    assert [each.accuracy for each in benchmark.transients] == list(Accuracy)
    for each in benchmark.transients:
        assert each.state_error <= each.promise
        assert each.response_error <= each.stated_error
        assert f"| {each.motion.name} | {each.growth:.0f} | " in page
        state = f"{each.state_error:.1e} ({each.promise:.1e})"
        assert f"{state}; {each.response_error:.1e} ({each.stated_error:.1e})" in page


def test_the_accuracy_page_names_motions_that_a_higher_level_does_not_improve(benchmark, page_of):
    motion = benchmark.motions[0]
    quick, standard, reference = motion.levels
    stuck = replace(motion, levels=(quick, replace(standard, state_error=quick.state_error), reference))
    assert "Only `reference` reduces the state error" in page_of(replace(benchmark, motions=(stuck,)))
    better = replace(standard, state_error=0.1 * quick.state_error)
    gained = replace(motion, levels=(quick, better, replace(reference, state_error=0.0)))
    assert "Each level reduces the state error" in page_of(replace(benchmark, motions=(gained,)))


def test_the_accuracy_page_in_docs_has_the_motions_and_columns_of_the_code(benchmark, page_of):
    kept = headings(PAGE.read_text(encoding="utf-8"))
    made = headings(page_of(benchmark))
    assert set(made) <= set(kept)
    assert [line for line in kept if line.startswith("## ") and ":" in line] == [
        f"## {each.regime.value.capitalize()}: {each.name}" for each in MOTIONS
    ]
