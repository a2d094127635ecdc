"""The claims page shows the verdicts, and the page in docs matches the claims in the code."""

import re
from pathlib import Path

import pytest

from tests.reading_reports import Page
from vibench.analysis.report import ReportTable, write_page
from vibench.cli.paper.claim import Verdict, at_least, claim, judgement
from vibench.cli.paper.options import SCORED_S, Case, damping
from vibench.cli.paper.page import (
    CLAIMS,
    HEAD,
    SECTIONS,
    Reproduction,
    reproduction_document,
    reproduction_page,
    target_text,
)
from vibench.cli.paper.reading import Evidence
from vibench.cli.paper.settings import DampingScore, score_figure, score_table

PAGE = Path(__file__).parents[2] / "docs" / "reproduction.md"
NO_STUDIES = Evidence(lambda study: pytest.fail(f"asked for {study}"))
WANTED = at_least("exponent", "1/s", 100.0)


def verdict_on(key, measure, **more):
    measure.__name__, measure.__doc__ = key, f"It is so with {key}."
    made = claim("section 3", "Read off.", WANTED, tried=(damping(3e-5),), **more)(measure)
    return judgement(made, NO_STUDIES, Case())


def by_damping(key, value_by_damping):
    return verdict_on(key, lambda reading: (value_by_damping[reading.case.damping_time_s],))


def score_rows(*held_and_failed):
    return tuple(
        DampingScore(damping_s, held, failed, -1.5, 120.0)
        for damping_s, (held, failed) in zip((2e-5, 3e-5), held_and_failed, strict=False)
    )


@pytest.fixture
def found():
    judgements = (
        by_damping("first", {2e-5: 120.0}),
        by_damping("second", {2e-5: 50.0, 3e-5: 130.0}),
        by_damping("third", {2e-5: 50.0, 3e-5: 60.0}),
    )
    scores = score_rows((("first",), ("second", "third")), (("first", "second"), ("third",)))
    regions = ReportTable("Regions", ("A0", "colliding"), (("1 µm", "nowhere"),), "Frequencies.")
    return Reproduction(
        {"Synthetic": judgements}, scores, (score_table(scores), regions), "Defaults: these.", "By nobody."
    )


def rows(page):
    return {
        match[1]: line
        for line in page.splitlines()
        if (match := re.match(r"\| \*\*([a-z0-9-]+)\*\*: ", line)) is not None
    }


def test_the_claims_page_counts_verdicts_and_shows_values(found):
    page = reproduction_document(found)
    assert [found.count(each) for each in Verdict] == [1, 0, 1, 1]
    assert "Of 3 claims 1 hold under the defaults," in page
    assert rows(page)["first"].endswith("| exponent: 120 1/s | ≥ 100 1/s | holds |")
    assert rows(page)["second"].endswith("| holds under c = 3e-05 s · k |")
    assert rows(page)["third"].endswith("| **does not hold** |")


def test_the_claims_page_lists_only_options_under_which_a_claim_holds(found):
    page = reproduction_document(found)
    assert "The claim holds under c = 3e-05 s · k. Exponent: 130 1/s." in page
    assert "exponent: 60 1/s" not in page


def test_the_claims_page_begins_with_differences_and_agreeing_options(found):
    summary = reproduction_document(found).split("## ")[0]
    assert "**first**" not in summary
    assert "second**: It is so with second. The claim holds under c = 3e-05 s · k. Exponent: 130" in summary
    assert "- **third**: It is so with third. The claim fails under all options (1)." in summary


def test_an_option_that_holds_for_some_initial_states_is_listed_with_their_number():
    """A claim that held for most initial states was once listed as "does not hold" only."""

    def measure(reading):
        return (130.0 if reading.case.damping_time_s == 3e-5 and reading.case.draw != 2 else 50.0,)

    found = verdict_on("chance", measure, draws=4)
    page = reproduction_document(
        Reproduction({"Synthetic": (found,)}, score_rows(((), ("chance",))), (), "Defaults: these.", "")
    )
    except_it = "; with c = 3e-05 s · k the claim holds for 3 of 4 starts"
    assert "fails under all options (1). With c = 3e-05 s · k the claim holds for 3 of 4 starts." in page
    assert rows(page)["chance"].endswith(f"| **does not hold**{except_it} |")
    assert "4 starts. Exponent: 130 1/s (50 to 130); from 4 starts." in page


def test_the_page_of_scores_names_the_best_damping_and_the_failed_claims(found):
    page = reproduction_document(found, (("A figure", "images/it.png"),))
    assert "this count is highest at 3e-05 s. Claims that fail at every damping: third." in page
    assert "| 2e-05 s | 1 of 3 | -1.5 | 120 | second |" in page
    assert "nowhere" not in page
    assert page.endswith("![A figure](images/it.png)\n")


def test_the_claims_report_begins_with_counts_and_has_a_card_per_section(found, tmp_path):
    score, levels = score_figure(found.scores), score_figure(found.scores)
    path = write_page(reproduction_page(found, levels, score), tmp_path / "report.html")
    page = Page(path.read_text(encoding="utf-8"))
    assert page.headings == ["claims on", "result", "agreement", "figure and remarks"]
    assert page.findings.startswith(
        "Of 3 claims 1 hold under the defaults, 0 under the defaults for some starts only, 1 under"
    )
    assert page.findings.endswith("Claims that do not hold: third.")
    assert "Synthetic 1 of 3 claims hold under the defaults. no second, third" in page.visible
    order = ["findings", "figure-1", "cards", "card-1", "further", "figure-2", "details"]
    assert [each for each in page.ids if each in order] == order
    for folded in (
        "third c = 3e-05 s · k: exponent: 60 1/s (does not hold)",
        "≥ 100 1/s",
        "Read off.",
        "nowhere",
    ):
        assert folded in page.text
    assert "exponent: 60 1/s" not in page.visible
    assert len(page.visible.split()) <= 2000


def test_every_claim_has_a_unique_key():
    assert len({claim.key for claim in CLAIMS}) == len(CLAIMS)


def test_the_claims_page_in_docs_matches_the_claims_in_the_code():
    page = PAGE.read_text(encoding="utf-8")
    kept = rows(page)
    assert list(kept) == [claim.key for claim in CLAIMS]
    assert page.count(HEAD) == len(SECTIONS)
    for each in CLAIMS:
        row = kept[each.key]
        assert row.startswith(f"| **{each.key}**: {each.says} | {each.place} |")
        assert f"| {target_text(each)} |" in row
        assert all(f"{wanted.name}: ".replace("|", "&#124;") in row for wanted in each.limits)


def test_the_claims_page_in_docs_has_the_damping_scores_and_figures():
    page = PAGE.read_text(encoding="utf-8")
    score_rows = re.findall(r"^\| (\S+) s \| \d+ of (\d+) \|", page, re.MULTILINE)
    asked = sum(claim.is_scored for claim in CLAIMS)
    assert [(float(each), int(of)) for each, of in score_rows] == [(each, asked) for each in SCORED_S]
    pictures = re.findall(r"^!\[.*\]\((.*)\)$", page, re.MULTILINE)
    assert pictures
    assert all((PAGE.parent / each).is_file() for each in pictures)
    counts = [
        int(each) for each in re.findall(r"^(?:Of \d+ claims )?(\d+) (?:hold )?under", page, re.MULTILINE)
    ]
    assert sum(counts) == len(CLAIMS)
