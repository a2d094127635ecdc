"""The page says what was found, and the page in docs was made by this code from these claims."""

import re
from pathlib import Path

import pytest

from analysis.figures.paper.options import FigureOptions
from analysis.reproduction.case import AS_CHOSEN, Case, damping
from analysis.reproduction.catalogue import CLAIMS, SECTIONS
from analysis.reproduction.claim import Claim, Verdict, judged
from analysis.reproduction.document import HEAD, Reproduction, reproduction_document, wanted_text
from analysis.reproduction.evidence import Evidence
from analysis.reproduction.expectation import at_least

PAGE = Path(__file__).parents[3] / "docs" / "reproduction.md"
CASE = Case(AS_CHOSEN, FigureOptions())


def judgement(key, value_by_damping):
    claim = Claim(
        key,
        "section 3",
        f"It is so with {key}.",
        "Read off.",
        (at_least("exponent", "1/s", 100.0),),
        lambda _, case: (value_by_damping[case.options.damping_time_s],),
        (damping(3e-5),),
    )
    return judged(claim, Evidence(lambda study: pytest.fail(f"asked for {study}")), CASE)


@pytest.fixture
def found():
    judgements = (
        judgement("first", {2e-5: 120.0}),
        judgement("second", {2e-5: 50.0, 3e-5: 130.0}),
        judgement("third", {2e-5: 50.0, 3e-5: 60.0}),
    )
    return Reproduction({"Synthetic": judgements}, "Defaults: these.", "Computed by nobody.")


def rows(page):
    return {
        match[1]: line
        for line in page.splitlines()
        if (match := re.match(r"\| \*\*([a-z0-9-]+)\*\*: ", line)) is not None
    }


def test_the_verdicts_are_counted_and_written_with_what_they_rest_on(found):
    page = reproduction_document(found)
    assert [found.count(each) for each in Verdict] == [1, 1, 1]
    assert "Of 3 claims 1 hold under the defaults," in page
    assert rows(page)["first"].endswith("| exponent: 120 1/s | ≥ 100 1/s | holds |")
    assert rows(page)["second"].endswith("| holds under c = 3e-05 s · k |")
    assert rows(page)["third"].endswith("| **does not hold** |")


def test_what_was_tried_is_written_with_its_numbers(found):
    page = reproduction_document(found)
    assert "- c = 3e-05 s · k: exponent: 60 1/s (does not hold)" in page
    assert "- c = 3e-05 s · k: exponent: 130 1/s (holds)" in page


def test_every_claim_has_a_key_of_its_own():
    assert len({claim.key for claim in CLAIMS}) == len(CLAIMS)


def test_the_page_in_docs_has_the_claims_columns_and_bounds_of_this_code():
    page = PAGE.read_text(encoding="utf-8")
    kept = rows(page)
    assert list(kept) == [claim.key for claim in CLAIMS]
    assert page.count(HEAD) == len(SECTIONS)
    for claim in CLAIMS:
        row = kept[claim.key]
        assert row.startswith(f"| **{claim.key}**: {claim.says} | {claim.place} |")
        assert f"| {wanted_text(claim)} |" in row
        assert all(f"{each.name}: ".replace("|", "&#124;") in row for each in claim.wanted)
        assert f"- **{claim.key}**: {claim.measured_by}" in page
