"""A report is one file that needs nothing else, says what the results say, and hides no failure."""

import json
import re
import shutil
from html.parser import HTMLParser

import pytest

from vibench.acquisition.recording import RecordingState
from vibench.analysis import (
    NotEnoughData,
    Simulation,
    analyse_files,
    budgets_of,
    campaign_summary,
    recordings_in,
    result_summary,
)
from vibench.analysis.report import write_report
from vibench.analysis.tables import plus_minus

VOID = {"meta", "img", "br", "link", "hr"}
RATE = 6400.0

pytestmark = pytest.mark.thorough


class Page(HTMLParser):
    """Collects what a page refers to, and whether its elements are closed in order."""

    def __init__(self, text):
        super().__init__()
        self.open, self.sources, self.links, self.texts = [], [], [], []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attributes):
        found = dict(attributes)
        self.sources += [found[key] for key in ("src", "data", "poster") if key in found]
        self.links += [found["href"]] if "href" in found else []
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.texts.append(data)

    @property
    def text(self):
        return re.sub(r"\s+", " ", "".join(self.texts))


@pytest.fixture(scope="module")
def campaign(dwell_file, noise_file, sweep_file):
    broken = dwell_file("weak", name="stopped", state=RecordingState.FAILED, reason="cable out", samples=6400)
    paths = [noise_file(), sweep_file, dwell_file("weak"), dwell_file("strong"), broken]
    return analyse_files(paths, "a <b>campaign</b> & more")


@pytest.fixture(scope="module")
def written(campaign, tmp_path_factory):
    folder = tmp_path_factory.mktemp("out")
    return write_report(campaign, folder / "report.html", folder / "figures")


@pytest.fixture(scope="module")
def page(written):
    return Page(written.read_text(encoding="utf-8"))


def test_a_report_needs_no_other_file_and_no_network(page):
    assert page.open == []
    assert page.sources
    assert all(each.startswith("data:image/") for each in page.sources)
    assert all(each.startswith("#") for each in page.links)


def test_a_report_holds_the_results_numbers(page, campaign):
    for found in campaign.noise[0].analysis.response.resonances:
        assert plus_minus(found.frequency_hz, 2 * found.sd_frequency_hz) in page.text
    middle = campaign.noise[0].analysis.response.resonances[0].frequency_hz
    assert f"resonances at {middle:.1f}" in page.text
    region = campaign.sweeps[0].analysis.collisions.regions[0]
    assert f"{region.start.frequency_hz:.1f} ({region.start.lower_hz:.1f} to" in page.text
    for dwell in campaign.dwells:
        for budget in budgets_of(dwell):
            assert budget.text.strip("()").split(")")[0] in page.text
    assert "not stated" in page.text
    assert "Uncertainty, and what it is made of" in page.text


def test_a_report_says_how_it_was_measured_and_that_it_was_simulated(page):
    for said in ("S-m0_velocity", "serial G-7", "amplifier gain", "6400 samples/s", "0123abc"):
        assert said in page.text
    assert "These recordings come from simulated instruments" in page.text


def test_a_recording_without_a_result_is_named_first_and_stops_no_other(page, campaign):
    assert [each.name for each in campaign.failures] == ["stopped.h5"]
    assert len(campaign.results) == 4
    assert page.text.index("cable out") < page.text.index("Resonances of the transmission")


def test_text_from_a_plan_is_shown_as_text(page):
    assert "a <b>campaign</b> & more" in page.text


def test_figures_are_saved_beside_the_report_with_their_numbers(written):
    names = {each.suffix for each in (written.parent / "figures").iterdir()}
    assert names == {".png", ".svg", ".csv"}


def test_one_recording_makes_a_report_of_its_own(dwell_file, tmp_path):
    results = analyse_files([dwell_file("weak")], "one", Simulation.LEFT_OUT)
    path = write_report(results, tmp_path / "one.html")
    page = Page(path.read_text(encoding="utf-8"))
    assert "Report of 1 recording," in page.text
    assert "simulation takes the damping" not in page.text


def test_a_report_of_nothing_is_refused(tmp_path):
    with pytest.raises(NotEnoughData, match="give the paths"):
        analyse_files([], "empty")
    with pytest.raises(NotEnoughData, match="holds no recording"):
        recordings_in(tmp_path)


def test_recordings_in_a_folder_come_in_the_order_they_were_begun(dwell_file, noise_file, tmp_path):
    shutil.copy(dwell_file("weak", name="b", started_utc="2026-02-28T12:00:00+00:00"), tmp_path)
    shutil.copy(noise_file(name="a"), tmp_path)
    (tmp_path / "broken.h5").write_bytes(b"nothing")
    assert [each.name for each in recordings_in(tmp_path)] == ["b.h5", "a.h5", "broken.h5"]
    failed = analyse_files(recordings_in(tmp_path)[2:], "x").failures
    assert failed[0].name == "broken.h5"


def test_a_summary_is_json_and_says_the_results(campaign):
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
