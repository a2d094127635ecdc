"""A copy of a recording under another name is not a second measurement."""

import shutil

import h5py
import numpy as np
import pytest

from vibench.acquisition import open_recording
from vibench.acquisition.recording import ResultArray
from vibench.analysis import Simulation, analyse_files, campaign_summary, compare_recording, recordings_in
from vibench.analysis.frequency_response.results import FrequencyResponseRequest
from vibench.analysis.report import check_warnings
from vibench.analysis.report._comparison import write_comparison


@pytest.fixture(scope="module")
def dwells(dwell_file, tmp_path_factory):
    folder = tmp_path_factory.mktemp("dwells")
    shutil.copy(dwell_file("weak"), folder / "weak.h5")
    shutil.copy(folder / "weak.h5", folder / "weak_copy.h5")
    return folder


def analysis_of(folder):
    return analyse_files(recordings_in(folder), "dwells", Simulation.LEFT_OUT)


def test_a_copy_of_a_recording_is_reported_and_not_counted(dwells):
    found = analysis_of(dwells)
    assert [each.name for each in found.facts] == ["weak"]
    said = "weak: copies: weak_copy.h5 has the same samples as weak.h5; they count once"
    assert said in list(check_warnings(found))
    assert len(campaign_summary(found)["results"]) == 1


def test_a_copy_with_added_results_and_a_link_are_counted_as_copies(dwells, tmp_path):
    shutil.copy(dwells / "weak.h5", tmp_path / "a.h5")
    (tmp_path / "b.h5").symlink_to(tmp_path / "a.h5")
    shutil.copy(dwells / "weak.h5", tmp_path / "c.h5")
    with open_recording(tmp_path / "c.h5") as recording:
        recording.save_results("late", {"ones": ResultArray(np.ones(3), "1")}, {})
    assert len(analysis_of(tmp_path).results) == 1


def test_two_recordings_of_the_same_samples_are_counted_once(dwell_file, tmp_path):
    for name in "ab":
        shutil.copy(dwell_file("weak"), tmp_path / f"{name}.h5")
    found = analysis_of(tmp_path)
    assert len(found.results) == 1
    assert any("has the same samples as" in each for each in check_warnings(found))


@pytest.mark.thorough
def test_a_different_recording_with_the_same_identity_gives_a_warning(dwells, dwell_file, tmp_path):
    shutil.copy(dwells / "weak.h5", tmp_path / "a.h5")
    shutil.copy(dwell_file("strong"), tmp_path / "b.h5")
    with h5py.File(tmp_path / "a.h5") as one, h5py.File(tmp_path / "b.h5", "r+") as other:
        other.attrs["recording_id"] = one.attrs["recording_id"]
        del other["seal"], other["overview"], other["view"]
    found = analysis_of(tmp_path)
    assert len(found.results) == 1
    (said,) = (each for each in check_warnings(found) if "copies" in each)
    assert "has the identity of the recording" in said


@pytest.mark.thorough
def test_a_report_of_a_comparison_counts_a_copy_once(dwells, tmp_path):
    request = FrequencyResponseRequest()
    compared = [compare_recording(each, request, Simulation.LEFT_OUT) for each in recordings_in(dwells)]
    curves = tuple(curve for each in compared for curve in each.curves)
    text = write_comparison(tmp_path / "both.html", curves, compared).read_text("utf-8")
    assert "Report of 1 recording." in text
    assert "weak_copy.h5 has the same samples as weak.h5" in text
