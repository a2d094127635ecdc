"""Claims of the paper are measured on short studies on a coarse grid."""

from dataclasses import replace

import pytest

from vibench.cli.paper.claim import finding
from vibench.cli.paper.options import SCORED_S, Case
from vibench.cli.paper.page import CLAIMS, SECTIONS, reproduction, reproduction_document
from vibench.cli.paper.reading import Evidence, Reading
from vibench.cli.paper.settings import score_figure, scores
from vibench.cli.paper.similarity_claims import rates
from vibench.sim import Accuracy
from vibench.sim.study import solve_study

SHORT = Case(accuracy=Accuracy.QUICK, duration_s=0.6, window_s=0.25, highest_hz=355.0)
LINEAR_KEYS = ("linear-resonances", "bound-resonances", "fits")
HERTZ_KEYS = ("regions-grow", "p-saturates", "second-region", "contrary-ii")


def claims(*keys):
    return [replace(claim, tried=()) for claim in CLAIMS if claim.key in keys]


@pytest.fixture(scope="module")
def evidence():
    return Evidence(lambda study: solve_study(study, workers=2))


def test_the_linear_claims_follow_from_the_specimen_and_need_no_study():
    none = Evidence(lambda study: pytest.fail(f"asked for {study}"))
    by_key = {each.key: finding(each, none, Case()) for each in claims(*LINEAR_KEYS)}
    assert by_key["linear-resonances"].is_met
    assert by_key["bound-resonances"].is_met
    assert not by_key["fits"].is_met
    overdamped = Case(damping_time_s=0.01, name="SI")
    assert not finding(claims("linear-resonances")[0], none, overdamped).is_met


@pytest.mark.thorough
def test_short_runs_show_the_effects_of_collisions(evidence):
    case = SHORT
    assert [each.key for each in claims(*HERTZ_KEYS) if not finding(each, evidence, case).is_met] == []
    asked = [each.study for each in evidence.studies]
    assert len(asked) == len(set(asked)) == 3


@pytest.mark.thorough
def test_models_are_compared_up_to_the_requested_frequency(evidence):
    low, all_of_it = (
        rates(Reading(evidence, replace(SHORT, similarity_highest_hz=each)), "power:3", "response_i")[2]
        for each in (50, 300)
    )
    assert low == 1.0
    assert all_of_it < 0.9


@pytest.mark.thorough
def test_the_claims_are_scored_for_each_damping(evidence):
    weak = replace(SHORT, highest_hz=25.0)
    found_scores = scores(claims("linear-resonances", "p-saturates"), evidence, weak)
    assert [each.damping_time_s for each in found_scores] == list(SCORED_S)
    assert all(len(each.held) + len(each.failed) == 2 for each in found_scores)
    drawn = score_figure(found_scores)
    assert drawn.tables[0].column("damping_time_s") == SCORED_S


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_every_claim_is_measured_and_the_page_is_written(evidence):
    told = []
    kept = {
        heading: tuple(replace(claim, tried=(), is_scored=False) for claim in section)
        for heading, section in SECTIONS.items()
    }
    result = reproduction(kept, evidence, replace(SHORT, highest_hz=600.0), told.append)
    assert told == [*(claim.key for claim in CLAIMS), "score by damping", "claims by setting"]
    page = reproduction_document(result)
    assert all(f"**{claim.key}**" in page for claim in CLAIMS)
