"""A report is one self-contained file with all results and all failures."""

import json
import shutil
from dataclasses import replace

import pytest

from tests.reading_reports import Page
from vibench.acquisition.recording import RecordingState
from vibench.analysis import (
    CampaignResults,
    NotEnoughData,
    Simulation,
    analyse,
    analyse_files,
    budgets_of,
    campaign_summary,
    merge_results,
    recordings_in,
    result_summary,
)
from vibench.analysis.kinds import Result
from vibench.analysis.recordings.checks import Check, Verdict
from vibench.analysis.report import draw_cards, recording_figures, result_figures, write_report
from vibench.analysis.report._report import CHANGE_A_CONCLUSION, LONGEST_CAPTION
from vibench.analysis.tables import plus_minus

pytestmark = pytest.mark.thorough


@pytest.fixture(scope="module")
def campaign(dwell_file, noise_file, sweep_file):
    broken = dwell_file("weak", name="stopped", state=RecordingState.FAILED, reason="cable out", samples=6400)
    paths = [noise_file(), sweep_file, dwell_file("weak"), dwell_file("strong"), broken]
    return analyse_files(paths, "a <b>campaign</b> & more")


@pytest.fixture(scope="module")
def report_path(campaign, tmp_path_factory):
    folder = tmp_path_factory.mktemp("out")
    return write_report(campaign, folder / "report.html", folder / "figures")


@pytest.fixture(scope="module")
def page(report_path):
    return Page(report_path.read_text(encoding="utf-8"))


def test_a_report_needs_no_other_file_and_no_network(page):
    assert page.open == []
    assert page.sources
    assert all(each.startswith("data:image/") for each in page.sources)
    assert all(each.startswith("#") for each in page.links)


def test_a_report_contains_the_numbers_of_its_results(page, campaign):
    for found in campaign.noise[0].analysis.response.resonances:
        assert plus_minus(found.frequency_hz, 2 * found.sd_frequency_hz) in page.text
    middle = campaign.noise[0].analysis.response.resonances[0].frequency_hz
    assert f"resonances at {middle:.1f}" in page.text
    assert f"{middle:.1f}" in page.findings
    region = campaign.sweeps[0].analysis.collisions.regions[0]
    assert f"{region.start.frequency_hz:.1f} ({region.start.lower_hz:.1f} to" in page.text
    for dwell in campaign.dwells:
        for budget in budgets_of(dwell):
            assert budget.text.strip("()").split(")")[0] in page.text
    assert "not stated" in page.text
    assert "Contributions to the uncertainty" in page.text


def test_a_report_begins_with_findings_figure_and_table_before_cards(page, campaign):
    order = ["findings", "figure-1", "cards", "card-1", "figure-2", "further", "details"]
    assert [each for each in page.ids if each in order] == order
    assert page.headings == ["recording", "result", "agreement", "figure and remarks"]
    names = [each.analysis.facts.name for each in campaign.in_order]
    rows = page.visible.split("figure and remarks")[1].split("Individual results")[0]
    places = [rows.index(f" {name} ") for name in (*names, "stopped.h5")]
    assert places == sorted(places)
    assert 10 < len(page.findings.split()) <= 120


def test_a_report_is_short_with_all_folds_closed_and_its_captions_have_three_lines(page):
    assert len(page.visible.split()) <= 2000
    assert page.captions
    assert max(map(len, page.captions)) <= len("Figure 99. . ") + LONGEST_CAPTION


def test_folded_sections_contain_statistics_and_checks_and_settings(page, campaign):
    facts = (
        "Contributions to the uncertainty", "Resonances of the transmission", "Checks", "How it ended",
        "impacts per second", "median difference", "independent averages", "Estimator",
        "coherence", "Frequencies with collisions in a sweep", "Dwells: responses over the last seconds",
        "noise bias of I", "Dwells: spectral lines of the displacement", "Channels", "sensitivity",
        "Versions that made the recordings", "half cosine", "samples/s", "crest factor",
        "of its range", "Phase portraits", "Orders of a sweep",
    )  # fmt: skip
    assert [each for each in facts if each not in page.text] == []
    assert [
        each for each in ("impacts per second", "crest factor", "noise bias") if each in page.visible
    ] == []
    for each in campaign.results:
        for budget in budgets_of(each):
            assert budget.quantity in page.text
        for check in each.analysis.checks:
            assert check.text.split("\n")[0] in page.text


def test_every_figure_has_one_legend_without_repeated_entries(campaign):
    drawn = [
        *result_figures(campaign),
        *(figure for each in campaign.results for figure in recording_figures(each)),
    ]
    for each in drawn:
        legends = [
            *each.figure.legends,
            *(axes.get_legend() for axes in each.figure.axes if axes.get_legend()),
        ]
        entries = [text.get_text() for legend in legends for text in legend.get_texts()]
        assert len(legends) <= 1, each.name
        assert len(entries) == len(set(entries)), each.name


def test_important_warnings_are_at_the_top_and_minor_warnings_are_at_their_recording(dwell_file, tmp_path):
    analysis = analyse(dwell_file("weak"))
    assert {each.what for each in analysis.checks} >= CHANGE_A_CONCLUSION - {"Copies", "Drop-outs"}
    for what, is_first in (("Overloads", True), ("Calibration", False)):
        checks = (Check(what, Verdict.WARNING, "look at it"),)
        results = CampaignResults("one", (Result(replace(analysis, checks=checks), None),), ())
        page = Page(write_report(results, tmp_path / "one.html").read_text(encoding="utf-8"))
        assert ("Read these warnings first" in page.visible) is is_first
        assert f"{what}: look at it" in page.visible
        assert f"Figure 1; not simulated; {what.lower()}" in page.visible


def test_a_report_states_the_instruments_the_settings_and_the_simulated_origin(page):
    for said in ("S-m0_velocity", "serial G-7", "amplifier gain", "6400 samples/s", "0123abc"):
        assert said in page.text
    assert "Some of these recordings come from simulated instruments" in page.text


def test_a_recording_without_a_result_is_named_first_in_the_report(page, campaign):
    assert [each.name for each in campaign.failures] == ["stopped.h5"]
    assert len(campaign.results) == 4
    assert page.visible.index("cable out") < page.visible.index("One recording of five gave no result.")
    assert page.visible.count("cannot tell") >= 1


def test_figures_are_saved_beside_the_report_with_their_numbers(report_path):
    names = {each.suffix for each in (report_path.parent / "figures").iterdir()}
    assert names == {".png", ".svg", ".csv"}


def test_cards_drawn_in_advance_give_the_same_report(dwell_file, tmp_path):
    parts = [analyse_files([dwell_file(level)], "two", Simulation.LEFT_OUT) for level in ("weak", "strong")]
    results = merge_results("two", parts)
    drawn = {each: card for part in parts for each, card in draw_cards(part).items()}
    pages = [
        Page(write_report(results, tmp_path / "two.html", None, drawn=some).read_text(encoding="utf-8"))
        for some in ({}, drawn)
    ]
    assert pages[0].sources == pages[1].sources
    assert pages[0].findings == pages[1].findings
    marked = {each: replace(card, result="taken from the card") for each, card in drawn.items()}
    path = write_report(results, tmp_path / "marked.html", drawn=marked)
    assert "taken from the card" in path.read_text(encoding="utf-8")
    figures = [card.figure for card in drawn.values()] + [
        each for card in drawn.values() for fold in card.folds for each in fold.figures
    ]
    assert figures
    assert not any(hasattr(each, "figure") for each in figures)  # they would take megabytes each


def test_a_report_of_one_recording_uses_the_singular(dwell_file, tmp_path):
    results = analyse_files([dwell_file("weak")], "one", Simulation.LEFT_OUT)
    path = write_report(results, tmp_path / "one.html")
    page = Page(path.read_text(encoding="utf-8"))
    assert "Report of 1 recording. This recording comes from simulated instruments." in page.text
    assert "simulation assumes damping" not in page.text


def test_an_empty_report_is_refused(tmp_path):
    with pytest.raises(NotEnoughData, match="give the paths"):
        analyse_files([], "empty")
    with pytest.raises(NotEnoughData, match="contains no recording"):
        recordings_in(tmp_path)
    (tmp_path / "run1").mkdir()
    (tmp_path / "run1" / "noise.h5").touch()
    with pytest.raises(NotEnoughData, match=r"give a folder with recordings, such as .*run1$"):
        recordings_in(tmp_path)


def test_recordings_of_a_folder_are_reported_in_order_of_their_start(dwell_file, noise_file, tmp_path):
    shutil.copy(dwell_file("weak", name="b", started_utc="2026-02-28T12:00:00+00:00"), tmp_path)
    shutil.copy(noise_file(name="a"), tmp_path)
    (tmp_path / "broken.h5").write_bytes(b"nothing")
    assert [each.name for each in recordings_in(tmp_path)] == ["b.h5", "a.h5", "broken.h5"]
    failed = analyse_files(recordings_in(tmp_path)[2:], "x").failures
    assert failed[0].name == "broken.h5"


def test_a_campaign_summary_is_json_and_states_the_results(campaign):
    document = json.loads(json.dumps(campaign_summary(campaign), allow_nan=False))
    assert document["failures"][0]["recording"] == "stopped.h5"
    kinds = [each["kind"] for each in document["results"]]
    assert kinds == ["noise", "sweep", "dwell", "dwell"]
    dwell = document["results"][2]
    assert dwell["measured"]["response_ii"] == campaign.results[2].analysis.response.response_ii
    assert dwell["simulated"]["impacts"] == 0
    assert dwell["recording"]["excitation"]["frequency_hz"] == 260.0


def test_every_kind_of_result_has_a_summary(stepped_file):
    found = analyse_files([stepped_file], "steps")
    document = result_summary(found.results[0])
    assert document["kind"] == "stepped_sine"
    assert document["measured"]["response_ii"] == list(found.results[0].analysis.response.response_ii)
    json.dumps(document, allow_nan=False)
