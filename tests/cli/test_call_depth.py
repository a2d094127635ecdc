"""Predictions and measurements pass few call frames; a prediction loads few files."""

import runpy
from pathlib import Path

import pytest

WALKS = runpy.run_path(str(Path(__file__).parents[2] / "benchmarks" / "walks.py"))
MOST_FRAMES, MOST_FILES, MOST_LOADED = 6, 40, 66
MOST_FRAMES_OF_A_BLOCK = 10


@pytest.fixture(scope="module")
def walk():
    return WALKS["amplitude_to_engine"]()


@pytest.mark.thorough
def test_a_prediction_reaches_the_engine_within_six_call_frames(walk):
    assert walk.frames[0].endswith("predict.py:predict")
    assert walk.frames[-1].endswith("library.py:Engine.run")
    assert len(walk.frames) <= MOST_FRAMES, walk.frames


def test_a_prediction_uses_and_loads_few_source_files(walk):
    assert 0 < len(walk.files) <= MOST_FILES, walk.files
    assert len(walk.files) < len(walk.loaded) <= MOST_LOADED, walk.loaded
    assert not any("_queue" in file or "_store" in file for file in walk.loaded)


@pytest.mark.thorough
@pytest.mark.timeout(600)  # a campaign under Python's profiler
def test_a_block_of_samples_reaches_the_recording_within_ten_call_frames(tmp_path):
    frames = WALKS["samples_to_file"](tmp_path).frames
    assert frames[0].endswith(":run_campaign")
    assert frames[-1].endswith(":RecordingWriter.append")
    assert len(frames) <= MOST_FRAMES_OF_A_BLOCK, frames
