"""Hidden motion on the Files page: p and its stops in the visible range, or an explanation."""

import re

import numpy as np
import pytest
from PySide6.QtWidgets import QFileDialog

from tests.analysis.hidden_motion import shaken_world
from vibench.acquisition import open_recording
from vibench.analysis.live import RecordingOverview, kept_levels
from vibench.gui.pages.files.spectrogram_view import Pictures
from vibench.gui.widgets.theme import DARK


@pytest.fixture(scope="module")
def shaken_recording(tmp_path_factory):
    return shaken_world.shake(tmp_path_factory.mktemp("shaken"), 260.0, 1.5, seed=61, duration_s=2.4)


@pytest.fixture
def pictures(shared_context, shaken_recording):
    """The pictures of the shaken recording, with the hidden motion in front."""
    pictures = Pictures(DARK, shared_context.background)
    pictures.resize(900, 600)
    pictures.setCurrentWidget(pictures.hidden_motion)
    pictures.show()
    with open_recording(shaken_recording.path) as recording:
        levels = {role: kept_levels(recording, role) for role in recording.roles}
        pictures.show_recording(RecordingOverview(recording, levels), "")
        yield pictures
        pictures.show_recording(None, "")
    pictures.close()


@pytest.mark.thorough
def test_hidden_motion_is_drawn_between_the_mechanical_stops(pictures, shaken_recording, wait_for):
    view = pictures.hidden_motion
    wait_for(lambda: not view.is_busy)
    assert "Zoom in" in view.plot._hint
    pictures.time_histories.show_range(1.0, 1.4)
    wait_for(lambda: "tracked in 100 %" in view.caption.text())
    time_s, p = view.tracked.getData()
    true = np.interp(time_s, np.arange(shaken_recording.p.size) / 51_200, shaken_recording.p)
    assert np.sqrt(np.mean((p - true) ** 2)) < 0.5e-6
    assert sorted(line.value() for line in view._stops) == pytest.approx([-45e-6, 45e-6])


@pytest.mark.thorough
def test_choosing_another_specimen_identifies_the_gaps_again(pictures, wait_for, tmp_path, monkeypatch):
    """With gaps 1 um too small, the track is lost; collisions then identify the gaps."""
    described = tmp_path / "tight.toml"
    described.write_text('name = "tight"\nabout = "1 um less"\nmodel = "gong2025"\ngap_m = 44e-6\n')
    monkeypatch.setattr(QFileDialog, "getOpenFileName", lambda *_: (str(described), ""))
    view = pictures.hidden_motion
    pictures.time_histories.show_range(0.6, 2.2)
    wait_for(lambda: "tracked in 100 %" in view.caption.text())
    last = view.specimen.count() - 1
    view.specimen.setCurrentIndex(last)
    view.specimen.activated.emit(last)
    assert view.specimen.currentText() == "tight.toml"
    wait_for(lambda: "elsewhere" in view.caption.text())
    view.find_numbers.click()
    wait_for(lambda: re.search(r"upper gap \((45\.0|44\.99)", view.caption.text()))
    assert "tracked in 100 %" in view.caption.text()
