"""A prediction passes few call frames and loads few files."""

import runpy
from pathlib import Path

import pytest

WALKS = runpy.run_path(str(Path(__file__).parents[2] / "benchmarks" / "walks.py"))
MOST_FRAMES, MOST_FILES, MOST_LOADED = 6, 40, 81


@pytest.fixture(scope="module")
def found():
    return WALKS["amplitude_to_engine"]()


def test_a_prediction_reaches_the_engine_within_six_frames(found):
    assert found.frames[0].endswith("predict.py:predict")
    assert found.frames[-1].endswith("library.py:Engine.run")
    assert len(found.frames) <= MOST_FRAMES, found.frames


def test_a_prediction_uses_and_loads_few_source_files(found):
    assert 0 < len(found.files) <= MOST_FILES, found.files
    assert len(found.files) < len(found.loaded) <= MOST_LOADED, found.loaded
    assert not any("_queue" in file or "_store" in file for file in found.loaded)
