"""Saving on a full disk gives one sentence and leaves every file unchanged."""

import pytest
from PySide6.QtWidgets import QFileDialog, QMessageBox

from tests.full_disk import full_disk
from vibench.acquisition.plan import Campaign
from vibench.analysis.errors import AnalysisError
from vibench.gui.page.app_context import SettingKey, Settings
from vibench.gui.pages.files.recording_table import add_note, export_recording
from vibench.gui.plots import plot_actions
from vibench.gui.plots.plot import Plot
from vibench.gui.widgets.notice import QUEUE, TEST

from ...attack.recordings_corpus import good_recordings


def content(folder):
    return {path.name: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.fixture
def own(tmp_path):
    folder = tmp_path / "own"
    folder.mkdir()
    return folder


@pytest.mark.thorough
@pytest.mark.parametrize("page", [TEST, QUEUE])
def test_saving_a_test_or_a_campaign_on_a_full_disk_gives_one_message(lasting_window, own, monkeypatch, page):
    measurement = lasting_window.context.selection.measurement
    lasting_window.context.selection.choose_campaign(Campaign(name="night", measurements=(measurement,)))
    (own / "mine.toml").write_text("older")
    monkeypatch.setattr(QFileDialog, "getSaveFileName", lambda *_: (str(own / "mine.toml"), ""))
    before, known = content(own), len(lasting_window.strip.notices)
    with full_disk():
        lasting_window.pages[page]._save()
    (notice,) = lasting_window.strip.notices[known:]
    assert "mine.toml: cannot be written" in notice.what
    assert "save the file elsewhere" in notice.what
    assert content(own) == before


@pytest.mark.parametrize("ending", ["png", "svg", "csv"])
def test_saving_a_plot_on_a_full_disk_gives_one_dialog(lasting_window, own, monkeypatch, ending):
    said = []
    monkeypatch.setattr(plot_actions, "new_path", lambda *_: own / f"plot.{ending}")
    monkeypatch.setattr(QMessageBox, "warning", lambda *given: said.append(given[-1]))
    with full_disk():
        plot_actions.save_plot(lasting_window.findChildren(Plot)[0])
    assert len(said) == 1
    assert "was not written: File too large" in said[0]
    assert content(own) == {}


@pytest.mark.thorough
@pytest.mark.parametrize("ending", ["csv", "uff", "mat", "nxs", "note"])
def test_exports_and_notes_on_a_full_disk_give_one_sentence_errors(own, ending):
    path = own / "dwell.h5"
    path.write_bytes(good_recordings()["dwell.h5"])
    before = content(own)
    with full_disk(), pytest.raises((AnalysisError, OSError), match="dwell") as refused:
        add_note(path, "glue") if ending == "note" else export_recording(path, own / f"dwell.{ending}")
    assert "\n" not in str(refused.value)
    assert content(own) == before


def test_saving_settings_on_a_full_disk_is_reported_and_keeps_the_old_file(qapp, own):
    settings = Settings(own / "window.ini")
    settings.keep_text(SettingKey.TEST, "older")
    assert settings.complaint == ""
    before = content(own)
    with full_disk():
        settings.keep_text(SettingKey.TEST, "newer" * 100)
        assert "window.ini could not be written" in settings.complaint
    assert content(own) == before


def test_the_bench_check_works_without_a_recording_folder(lasting_window, own, monkeypatch):
    """An impossible folder raised an error in the window before the engine could report it."""
    orders = []
    (own / "file").touch()
    lasting_window.context.choose_folder(own / "file" / "recordings")
    monkeypatch.setattr(type(lasting_window.user_actions), "_may", lambda *_: True)
    monkeypatch.setattr(lasting_window.context.bridge, "order", lambda *given, **_: orders.append(given))
    lasting_window.user_actions.check()
    assert orders[0][1] == own / "file" / "recordings"
