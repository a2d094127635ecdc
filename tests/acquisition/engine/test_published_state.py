"""The state that viewers see of a run: reset for each recording, rows only when they change."""

import shutil
from threading import Event
from types import SimpleNamespace

import numpy as np
import pytest

from vibench.acquisition.campaign import PointOutcome, PointResult, ReasonCode
from vibench.acquisition.engine import Supervision
from vibench.acquisition.engine._published_state import PublishedState

from .conftest import BENCH, campaign, progress


@pytest.fixture
def published(tmp_path):
    published = PublishedState(Supervision.UNATTENDED)
    published.begin(campaign("point"), tmp_path)
    return published


def test_a_repeated_measurement_is_published_as_a_new_run(published, tmp_path):
    published.note_progress(progress(tmp_path / "point.h5", 0, 1.0), BENCH)
    published.note_progress(progress(tmp_path / "point.h5", 100, 1.0), BENCH)
    first = published.status()
    published.note_progress(progress(tmp_path / "point.attempt2.h5", 0, 2.0), BENCH)
    second = published.status()
    assert (first.samples, second.samples) == (200, 100)
    assert second.run_id == first.run_id + 1
    assert second.lost_blocks == 0
    np.testing.assert_array_equal(
        published.sample_buffer.samples_since(0, 1000).volts, np.full((1, 100), np.float32(2.0))
    )


def test_the_row_version_changes_only_when_a_row_changes(published, tmp_path):
    published.note_progress(progress(tmp_path / "point.h5", 0, 1.0), BENCH)
    running = published.status().rows_number
    published.note_progress(progress(tmp_path / "point.h5", 100, 1.0), BENCH)
    assert published.status().rows_number == running
    published.note_result(
        PointResult("point", PointOutcome.RECORDED, tmp_path / "point.h5", "", next(iter(ReasonCode)))
    )
    assert published.status().rows_number > running
    assert [row.state for row in published.status().rows] == ["recorded"]


def test_a_missing_folder_is_published_as_no_free_disk_space(published, tmp_path):
    gone = tmp_path / "gone"
    published.begin(campaign("point"), gone)
    published.note_progress(progress(gone / "point.h5", 0, 1.0), BENCH)
    published._beside.wait(10)
    assert published.status().disk_free_bytes == 0


def test_the_elapsed_time_includes_points_kept_from_an_earlier_run(published, tmp_path):
    twice = campaign("made", "point")
    published.begin(twice, tmp_path)
    published.note_result(
        PointResult("made", PointOutcome.KEPT, tmp_path / "made.h5", "", next(iter(ReasonCode)))
    )
    published.note_progress(progress(tmp_path / "point.h5", 0, 1.0), BENCH)
    run = published.status().run
    assert run.campaign_elapsed_s == pytest.approx(twice.duration_s / 2 + run.elapsed_s)


def test_an_unresponsive_folder_does_not_block_a_run(published, tmp_path, monkeypatch):
    is_back = Event()
    monkeypatch.setattr(shutil, "disk_usage", lambda folder: is_back.wait() and SimpleNamespace(free=7))
    published.note_progress(progress(tmp_path / "point.h5", 0, 1.0), BENCH)
    assert published.status().samples == 100
    is_back.set()
    published._beside.wait(10)
    assert published.status().disk_free_bytes == 7
