"""Opening and dropping files, undoing edits, settings and help."""

from pathlib import Path

import pytest
from PySide6.QtCore import QMimeData, QPointF, Qt, QUrl
from PySide6.QtGui import QDropEvent, QTextDocument
from PySide6.QtWidgets import QApplication, QDialogButtonBox, QLabel, QMenu

from vibench.acquisition import save_toml, shipped
from vibench.gui.__main__ import NO_WINDOW, _sign_of_life, main
from vibench.gui.widgets.notice import COMPARE, FILES, QUEUE, RIG, TEST
from vibench.gui.widgets.theme import DARK
from vibench.gui.window.menus import SettingsDialog, show_about, show_manual


def drop(window, *paths):
    data = QMimeData()
    data.setUrls([QUrl.fromLocalFile(str(path)) for path in paths])
    window.dropEvent(
        QDropEvent(
            QPointF(5, 5),
            Qt.DropAction.CopyAction,
            data,
            Qt.MouseButton.LeftButton,
            Qt.KeyboardModifier.NoModifier,
        )
    )


@pytest.mark.thorough
def test_a_dropped_file_opens_on_its_page_and_is_listed_as_recent(window, tmp_path):
    test = tmp_path / "mine.toml"
    measurement = window.context.selection.measurement.model_copy(update={"name": "mine"})
    save_toml(measurement, test)
    drop(window, test)
    assert window.page is window.pages[TEST]
    assert window.context.selection.measurement.name == "mine"
    campaign, rig = shipped("campaigns/quick.toml"), shipped("hardware_configs/lab_rig.toml")
    drop(window, campaign)
    assert window.page is window.pages[QUEUE]
    assert window.context.selection.campaign.name == "quick"
    drop(window, rig)
    assert window.page is window.pages[RIG]
    assert window.context.selection.rig.virtual is None
    assert window.context.recent_files == (rig, campaign, test)
    menu = next(each for each in window.menuBar().findChildren(QMenu) if "recent" in each.title())
    menu.aboutToShow.emit()
    assert [each.text() for each in menu.actions()] == [str(rig), str(campaign), str(test)]
    menu.actions()[2].trigger()
    assert window.page is window.pages[TEST]
    drop(window, tmp_path)
    assert window.page is window.pages[FILES]


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("name", "content"),
    [("a.txt", b"x"), ("a.toml", b"\xff"), ("b.toml", b"a = 1"), ("c.toml", b"["), ("gone.toml", None)],
)
def test_unsupported_files_are_reported_and_change_nothing(lasting_window, tmp_path, name, content):
    if content is not None:
        (tmp_path / name).write_bytes(content)
    before = lasting_window.page
    drop(lasting_window, tmp_path / name)
    assert lasting_window.page is before
    assert name in lasting_window.strip.notices[-1].what
    assert lasting_window.context.recent_files == ()


@pytest.mark.thorough
def test_a_file_that_is_not_a_recording_is_reported_on_the_files_page(lasting_window, qtbot, tmp_path):
    (tmp_path / "broken.h5").write_bytes(b"no file of that kind")
    drop(lasting_window, tmp_path / "broken.h5")
    assert lasting_window.page is lasting_window.pages[COMPARE]
    qtbot.waitUntil(lambda: "broken.h5" in lasting_window.strip.notices[-1].what, timeout=100_000)


@pytest.mark.thorough
def test_edits_of_a_test_and_of_a_campaign_can_be_undone(window, qtbot):
    selection, key = window.context.selection, Qt.KeyboardModifier.ControlModifier
    window.show_page(TEST)
    first = selection.measurement
    form = window.pages[TEST].form
    form.show_value(first.model_copy(update={"ramp_s": 1.25}))
    form.show_value(first.model_copy(update={"ramp_s": 1.5}))
    qtbot.keyClick(window, Qt.Key.Key_Z, key)
    assert selection.measurement.ramp_s == 1.25
    window.undo()
    assert selection.measurement == first
    window.undo()
    assert selection.measurement == first
    qtbot.keyClick(window, Qt.Key.Key_Z, key | Qt.KeyboardModifier.ShiftModifier)
    assert selection.measurement.ramp_s == 1.25
    window.show_page(QUEUE)
    queue = window.pages[QUEUE]
    queue.open_file(shipped("campaigns/quick.toml"))
    before = selection.campaign
    queue._add_test()
    assert selection.campaign != before
    window.undo()
    assert selection.campaign == before


@pytest.mark.thorough
def test_all_settings_are_edited_in_one_form_and_stored(window, qapp, tmp_path):
    dialog = SettingsDialog(window.context, window)
    points = qapp.font().pointSize()
    dialog.form.form.show_content(
        {"theme": "dark", "font_pt": 12, "patience_s": 4.0, "recordings_folder": str(tmp_path / "elsewhere")}
    )
    try:
        dialog.accept()
        assert window.context.theme is DARK
        assert qapp.font().pointSize() == 12
        assert window.context.patience_s == 4.0
        assert window.context.folder == tmp_path / "elsewhere"
    finally:
        font = QApplication.font()
        font.setPointSize(points)
        QApplication.setFont(font)
    dialog.form.form.show_content({**dialog.form.form.content(), "patience_s": 99.0})
    assert not dialog.buttons.button(QDialogButtonBox.StandardButton.Ok).isEnabled()
    assert "Patience (s)" in dialog.form.complaint
    assert "at most 10 s" in dialog.form.complaint


@pytest.mark.thorough
def test_the_help_works_offline_and_lists_installed_versions(window, qtbot):
    qtbot.keyClick(window, Qt.Key.Key_F1)
    keys = next(each for each in window.findChildren(QLabel) if "<table>" in each.text())
    assert all(word in keys.text() for word in ("F5", "F6", "Ctrl+7", "Ctrl+Z", "Shift+F1", "Esc, Pause"))
    keys.window().close()
    manual = show_manual(window)
    assert manual.browser.sourceType() is QTextDocument.ResourceType.MarkdownResource
    assert "A first measurement" in manual.browser.toPlainText()
    about = show_about(window, window.context)
    qtbot.waitUntil(lambda: "python" in about.browser.toPlainText(), timeout=100_000)
    next(each for each in about.buttons.buttons() if "Copy" in each.text()).click()
    assert "python" in QApplication.clipboard().text()
    assert Path(manual.browser.source().toLocalFile()).name == "gui.md"
    manual.close()
    about.close()


def test_a_missing_bench_file_is_refused_before_a_window_opens(tmp_path, capsys):
    assert main(["--bench", str(tmp_path / "missing.toml")]) == NO_WINDOW
    said = capsys.readouterr().err
    assert "missing.toml" in said
    assert said.startswith("error: ")
    assert len(said.splitlines()) == 1


def test_control_characters_in_a_bench_name_have_no_effect(tmp_path, capsys):
    (tmp_path / "a\x1b[2J\u202e.toml").write_text("name = 1", encoding="utf-8")
    assert main(["--bench", str(tmp_path / "a\x1b[2J\u202e.toml")]) == NO_WINDOW
    assert r"a\x1b[2J\u202e.toml: name = 1" in capsys.readouterr().err


def test_the_start_message_appears_in_a_window_titled_vibench(qapp):
    """The title was the name of the program file."""
    label = _sign_of_life()
    assert label.windowTitle() == "vibench"
    label.close()
