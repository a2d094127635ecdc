"""Claims are measured on studies that are solved here: short runs, on the coarse grid."""

from dataclasses import replace

import numpy as np
import pytest

from vibench.cli.paper.case import AS_CHOSEN, SCORED_S, Case
from vibench.cli.paper.claim import found
from vibench.cli.paper.claims import CLAIMS, SECTIONS
from vibench.cli.paper.damping_score import damping_score_figure
from vibench.cli.paper.document import reproduction_document
from vibench.cli.paper.evidence import Evidence
from vibench.cli.paper.options import FigureOptions
from vibench.cli.paper.page_tables import regions, regions_table
from vibench.cli.paper.reproduce import reproduction
from vibench.cli.paper.score import scores
from vibench.sim import Accuracy
from vibench.sim.study import solve_study

SHORT = FigureOptions(accuracy=Accuracy.QUICK, duration_s=0.6, window_s=0.25, highest_hz=355.0)
LINEAR_KEYS = ("linear-resonances", "bound-resonances", "fits")
HERTZ_KEYS = ("regions-grow", "p-saturates", "second-region", "contrary-ii")


def claims(*keys):
    return [replace(claim, alternatives=()) for claim in CLAIMS if claim.key in keys]


@pytest.fixture(scope="module")
def evidence():
    return Evidence(lambda study: solve_study(study, workers=2))


def test_the_linear_claims_follow_from_the_specimen_and_need_no_study():
    none = Evidence(lambda study: pytest.fail(f"asked for {study}"))
    by_key = {each.key: found(each, none, Case(AS_CHOSEN, FigureOptions())) for each in claims(*LINEAR_KEYS)}
    assert by_key["linear-resonances"].is_met
    assert by_key["bound-resonances"].is_met
    assert not by_key["fits"].is_met
    overdamped = Case("SI", FigureOptions(damping_time_s=0.01))
    assert not found(claims("linear-resonances")[0], none, overdamped).is_met


@pytest.mark.thorough
def test_short_runs_already_show_what_collisions_do(evidence):
    case = Case(AS_CHOSEN, SHORT)
    assert [each.key for each in claims(*HERTZ_KEYS) if not found(each, evidence, case).is_met] == []
    asked = [each.study for each in evidence.studies]
    assert len(asked) == len(set(asked)) == 3


def test_the_score_turns_on_the_damping_alone(evidence):
    weak = replace(SHORT, highest_hz=25.0)
    found_scores = scores(claims("linear-resonances", "p-saturates"), evidence, Case(AS_CHOSEN, weak))
    assert [each.damping_time_s for each in found_scores] == list(SCORED_S)
    assert all(len(each.held) + len(each.failed) == 2 for each in found_scores)
    drawn = damping_score_figure(found_scores)
    assert drawn.tables[0].column("damping_time_s") == SCORED_S


def test_regions_are_runs_of_neighbours():
    f = np.arange(5.0, 50.0, 5.0)
    flags = np.array([1, 1, 0, 0, 1, 0, 1, 1, 1], dtype=bool)
    assert regions(f, flags) == ((5.0, 10.0), (25.0, 25.0), (35.0, 45.0))
    assert regions(f, np.zeros(9, dtype=bool)) == ()


def test_the_table_of_regions_has_every_amplitude(evidence):
    table = regions_table(evidence, Case(AS_CHOSEN, SHORT))
    assert [row[0] for row in table.rows] == ["1 µm", "5 µm", "10 µm", "50 µm"]


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_every_claim_is_measured_and_the_page_is_written(evidence):
    told = []
    kept = {
        heading: tuple(replace(claim, alternatives=(), is_scored=False) for claim in section)
        for heading, section in SECTIONS.items()
    }
    result = reproduction(kept, evidence, Case(AS_CHOSEN, replace(SHORT, highest_hz=600.0)), told.append)
    assert told == [*(claim.key for claim in CLAIMS), "score by damping", "claims by setting"]
    page = reproduction_document(result)
    assert all(f"**{claim.key}**" in page for claim in CLAIMS)
