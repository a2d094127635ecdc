"""The Files page lists, opens and zooms real recordings."""

import re
import shutil

import h5py
import numpy as np
import pytest
from PySide6.QtCore import QPointF, Qt
from PySide6.QtWidgets import QFileDialog, QInputDialog

from vibench.acquisition import load_toml, shipped
from vibench.acquisition.campaign import JournalPointState, ReasonCode
from vibench.acquisition.campaign._journal import BenchIdentity, Journal, journal_path
from vibench.acquisition.plan import Campaign, Dwell, Measurement
from vibench.acquisition.recording import RecordingState, open_recording
from vibench.acquisition.rig import Rig
from vibench.analysis.live import thumbnail
from vibench.gui.forms.quantity_edit import LineField
from vibench.gui.pages.files import files_page as _files_page
from vibench.gui.pages.files.files_page import FilesPage
from vibench.gui.pages.files.recording_table import (
    HEADINGS,
    add_note,
    facts_text,
    read_levels,
    read_listing,
    whole_check,
)

IMPACT_S = 40_002 / 6400.0


def _begin_campaign(folder):
    """Write a journal of three points: done, failed and waiting."""
    rig = load_toml(shipped("hardware_configs/virtual_rig.toml"), Rig)
    played = Dwell(amplitude_vpp=1, frequency_hz=260, duration_s=1)
    plans = tuple(Measurement(name=name, excitation=played) for name in ("whole", "stopped", "later"))
    bench = BenchIdentity(rig=rig, instruments={}, knobs={})
    with Journal.begin(
        journal_path(folder, "night"), Campaign(name="night", measurements=plans), bench
    ) as journal:
        for name, state, why in (
            ("whole", JournalPointState.DONE, ReasonCode.CARRIED_OUT),
            ("stopped", JournalPointState.FAILED, ReasonCode.LIMIT),
        ):
            journal.start(name, f"{name}.h5")
            journal.end(name, state, why, "so it was")


@pytest.fixture(scope="module")
def folder(tmp_path_factory, record):
    folder = tmp_path_factory.mktemp("recordings")
    record(folder, "whole")
    record(folder, "stopped", 95.0, RecordingState.STOPPED)
    shutil.copyfile(folder / "whole.h5", folder / "old.h5")
    with h5py.File(folder / "old.h5", "r+") as file:
        del file["overview"], file["seal"]
    (folder / "broken.h5").write_bytes(b"no HDF5")
    _begin_campaign(folder)
    return folder


@pytest.fixture(scope="module")
def shared_page(shared_context, folder, wait_for):
    """One page for all tests: starting its processes takes seconds."""
    shared_context.choose_folder(folder)
    page = FilesPage(shared_context)
    page.resize(1200, 800)
    page.show()
    page.enter()
    wait_for(lambda: len(page.table.recordings.entries) == 4 and not shared_context.background.is_busy)
    yield page
    page.time_histories.show_recording(None)
    page.close()


@pytest.fixture
def page(shared_page, folder, wait_for):
    if (shared_page.context.folder, shared_page._folder) != (folder, folder):
        shared_page.context.choose_folder(folder)
    wait_for(lambda: not shared_page.context.background.is_busy)
    shared_page.table.shown_rows.setFilterFixedString("")
    return shared_page


@pytest.fixture
def show_file(page, folder, wait_for):
    """Open a recording by its row, and wait until its time histories are shown."""

    def open_row(name):
        page.table.choose(folder / name)
        wait_for(lambda: bool(page.time_histories.plots) and page._opened.path == folder / name)
        return page

    return open_row


def cell(page, name, heading):
    model = page.table.model()
    for row in range(model.rowCount()):
        if model.index(row, HEADINGS.index("Name")).data() == name:
            return model.index(row, HEADINGS.index(heading)).data()
    raise AssertionError(f"{name} is not listed")


def curve_data(page, number):
    (curve, *_) = page.time_histories.plots[number].getPlotItem().listDataItems()
    return curve.getData()


@pytest.mark.thorough
def test_the_list_describes_the_state_the_plan_and_the_problems_of_every_file(page):
    assert cell(page, "whole", "State") == "✔ complete"
    assert cell(page, "stopped", "State") == "■ stopped"
    assert cell(page, "broken", "State") == "✖ unreadable"
    assert cell(page, "stopped", "Excitation") == "dwell 95 Hz"
    assert cell(page, "whole", "Level") == "1 Vpp"
    assert "full scale" in cell(page, "whole", "Verdict")
    assert cell(page, "whole", "Length") == "10 s"


def test_columns_and_fields_are_wide_enough_on_the_smallest_screen(page):
    page.resize(860, 560)
    table, fonts = page.table, page.fontMetrics()
    for column in range(1, len(HEADINGS)):
        for row in range(table.model().rowCount()):
            text = table.model().index(row, column).data()
            assert table.columnWidth(column) >= min(fonts.horizontalAdvance(text), 200), text
    assert page.findChild(LineField).width() > fonts.averageCharWidth() * 20


def test_a_recording_without_its_seal_gets_a_warning(show_file, wait_for):
    page = show_file("old.h5")
    assert "seal gone" in cell(page, "old", "Verdict")
    wait_for(lambda: page._facts.sentence.startswith("✖ seal gone: its seal is gone"))


@pytest.mark.thorough
def test_samples_that_differ_from_their_seal_get_a_warning(page, folder, tmp_path, wait_for):
    """The quick check of a seal reads no samples of a large file."""
    path = tmp_path / "changed.h5"
    shutil.copyfile(folder / "whole.h5", path)
    with h5py.File(path, "r+") as file:
        file["m0_velocity"][...] = file["m0_velocity"][...] // 2
    page.open_path(path)
    wait_for(lambda: "unchanged since it was sealed, samples not checked" in page._facts.sentence)
    wait_for(lambda: page._facts.sentence.startswith("✖ damaged: changed since sealing: data of /m0_velo"))
    page.open_path(folder / "whole.h5")
    wait_for(lambda: "  ·  unchanged since it was sealed  ·  " in page._facts.sentence)


def test_control_characters_in_names_have_no_effect(page, folder, wait_for, tmp_path):
    shutil.copyfile(folder / "whole.h5", tmp_path / "a\x1b[2J\u202eb\n<b>c.h5")
    page._go_to(tmp_path)
    wait_for(lambda: len(page.table.recordings.entries) == 1 and not page.context.background.is_busy)
    index = page.table.recordings.index(0, HEADINGS.index("Name"))
    assert index.data() == r"a\x1b[2J\u202eb\n<b>c"
    assert r"a\x1b[2J\u202eb\n&lt;b&gt;c.h5" in index.data(Qt.ItemDataRole.ToolTipRole)
    page.table.choose(tmp_path / "a\x1b[2J\u202eb\n<b>c.h5")
    wait_for(lambda: page._title.text() == r"a\x1b[2J\u202eb\n<b>c.h5")
    page._go_to(folder)


def test_every_readable_recording_has_a_thumbnail(page):
    model = page.table.recordings
    pictures = {
        entry.name: model.index(row, 0).data(Qt.ItemDataRole.DecorationRole)
        for row, entry in enumerate(model.entries)
    }
    assert {name for name, picture in pictures.items() if picture is not None} == {"whole", "stopped", "old"}


def test_an_impact_of_three_samples_is_visible_at_every_zoom(show_file):
    page = show_file("whole.h5")
    for low_s, high_s in ((0.0, 10.0), (IMPACT_S - 0.5, IMPACT_S + 0.5), (IMPACT_S - 2e-3, IMPACT_S + 2e-3)):
        page.time_histories.show_range(low_s, high_s)
        page.time_histories._draw()
        time_s, values = curve_data(page, 2)
        assert np.nanmax(values) == pytest.approx(0.4, rel=1e-5)
        assert np.nanmin(values) == pytest.approx(-0.5, rel=1e-5)
        assert time_s[0] <= low_s + 0.01
        assert len(time_s) <= 2.1 * page.time_histories.width()


def test_a_recording_without_an_overview_can_be_opened(show_file):
    page = show_file("old.h5")
    assert np.nanmax(curve_data(page, 2)[1]) == pytest.approx(0.4, rel=1e-5)


def test_the_page_shows_a_reason_and_a_remedy_for_a_broken_file(page, show_file, folder, qtbot):
    with qtbot.waitSignal(page.context.noticed) as said:
        page.table.choose(folder / "broken.h5")
    assert "is not a readable HDF5 file" in said.args[0].what
    assert page.time_histories.plots == ()
    assert len(show_file("whole.h5").time_histories.plots) == 3


def test_the_view_can_be_zoomed_panned_and_reset_by_keys(show_file, qtbot):
    page = show_file("whole.h5")
    qtbot.keyClick(page.time_histories, Qt.Key.Key_Plus)
    low_s, high_s = page.time_histories.view_s
    assert high_s - low_s == pytest.approx(6.0)
    qtbot.keyClick(page.time_histories, Qt.Key.Key_Right)
    assert page.time_histories.view_s[0] == pytest.approx(low_s + 1.2)
    qtbot.keyClick(page.time_histories, Qt.Key.Key_Home)
    assert page.time_histories.view_s == pytest.approx((0.0, 10.0))


def test_zoom_and_pan_stay_within_the_recording_and_show_at_least_a_few_samples(show_file):
    page = show_file("whole.h5")
    page.time_histories.show_range(-50.0, 100.0)
    assert page.time_histories.view_s == (0.0, 10.0)
    page.time_histories.show_range(5.0, 5.0 + 1e-9)
    low_s, high_s = page.time_histories.view_s
    assert high_s - low_s == pytest.approx(8 / 6400.0, rel=1e-3)


def test_markers_measure_time_differences(show_file):
    page = show_file("whole.h5")
    page._markers.setChecked(True)
    markers = page.time_histories.markers
    for (_, line, *_), time_s in zip(markers.lines, (2.0, 2.5), strict=True):
        line.setValue(time_s)
        line.sigDragged.emit(line)
    assert markers.values == (2.0, 2.5)
    assert markers.lines[0][0].value() == 2.0
    assert "0.5 s apart = 1 / 2 Hz" in page._view.text()


def test_the_search_keeps_the_rows_that_contain_all_words(page):
    page.table.shown_rows.setFilterFixedString("95 hz")
    assert page.table.model().rowCount() == 1
    page.table.shown_rows.setFilterFixedString("")
    assert page.table.model().rowCount() == 4


def test_a_campaign_shows_its_progress_and_its_recordings(page):
    assert page.campaigns.isVisible()
    assert page.campaigns.itemText(1) == "▲ night: 1 of 3 done, 1 queued, 1 failed"
    page.campaigns.setCurrentIndex(1)
    model = page.table.model()
    names = {model.index(row, HEADINGS.index("Name")).data() for row in range(model.rowCount())}
    assert names == {"whole", "stopped"}
    page.campaigns.setCurrentIndex(0)
    assert model.rowCount() == 4


def test_selected_recordings_can_be_sent_to_the_compare_page(page, folder, qtbot):
    page.table.selectAll()
    with qtbot.waitSignals([page.context.comparison_requested, page.context.page_requested]):
        page._compare.click()
    assert set(page.table.chosen_paths()) == {
        folder / f"{n}.h5" for n in ("whole", "stopped", "old", "broken")
    }


def test_a_recording_from_another_folder_can_be_opened(page, record, tmp_path, qtbot):
    path = record(tmp_path, "elsewhere")
    page.context.recording_requested.emit(path)
    qtbot.waitUntil(lambda: page._opened.path == path)
    qtbot.waitUntil(lambda: page.table.chosen_paths() == (path,), timeout=20_000)


@pytest.mark.thorough
def test_the_spectrogram_of_the_visible_range_shows_the_drive_and_the_impact(show_file, wait_for):
    page = show_file("whole.h5")
    view = page.pictures.spectrogram
    page.pictures.setCurrentWidget(view)
    for spacing in range(view.spacing.count()):
        view.spacing.setCurrentIndex(spacing)
        wait_for(lambda: not view.is_busy and view.image.item.image is not None)
        item = view.image.item
        box = item.mapRectToParent(item.boundingRect())
        loudest = int(np.argmax(np.median(item.image, axis=1)))
        place = box.top() + (loudest + 0.5) / item.image.shape[0] * box.height()
        assert (10**place if spacing else place) == pytest.approx(260.0, abs=25)  # lines are 25 Hz apart
        struck = int(np.argmax(np.sum(item.image, axis=0)))
        at_s = box.left() + (struck + 0.5) / item.image.shape[1] * box.width()
        assert at_s == pytest.approx(IMPACT_S, abs=0.1)
    assert "dB re 1 (m/s)²/Hz" in view.image.bar.axis.labelText
    assert view.plot.isEnabled()
    view.channel.setCurrentIndex(0)
    assert not view.plot.isEnabled(), "a picture of another channel"
    wait_for(lambda: not view.is_busy)
    assert view.plot.isEnabled()
    page.pictures.setCurrentWidget(page.time_histories)


def test_opening_a_recording_by_its_path_reads_the_file_once(show_file, folder, wait_for, monkeypatch):
    page, read = show_file("stopped.h5"), []

    def counted(path):
        read.append(path)
        return open_recording(path)

    monkeypatch.setattr(_files_page, "open_recording", counted)
    page.open_path(folder / "whole.h5")
    wait_for(lambda: page._opened.path == folder / "whole.h5" and len(page.time_histories.plots) == 3)
    assert read == [folder / "whole.h5"]


@pytest.mark.thorough
def test_a_recording_may_finish_while_it_is_displayed(page, begin_recording, tmp_path, wait_for):
    writer, part = begin_recording(tmp_path, "growing")
    page.context.choose_folder(tmp_path)
    page.list_folder()
    wait_for(lambda: [entry.path for entry in page.table.recordings.entries] == [part])
    said = []
    page.context.noticed.connect(said.append)
    final = writer.finish(RecordingState.COMPLETE, "the plan was carried out")
    page.open_path(part)
    wait_for(lambda: len(page.time_histories.plots) == 3 and page.table.chosen_paths() == (final,))
    assert page._opened.path == final
    assert set(read_levels(part)) == set(page._opened.roles)
    assert thumbnail(part) is not None
    page.context.noticed.disconnect(said.append)
    assert said == []


def test_time_histories_name_channels_and_units(show_file):
    page = show_file("whole.h5")
    assert [plot.accessibleName() for plot in page.time_histories.plots] == [
        "drive voltage over time",
        "base acceleration over time",
        "m0 velocity over time",
    ]
    assert [plot.up.labelText for plot in page.time_histories.plots] == ["V", "m/s²", "mm/s"]


def test_a_file_list_that_arrives_late_keeps_the_current_selection(page, shared_context, wait_for):
    page.table.selectAll()
    chosen = page.table.chosen_paths()
    assert len(chosen) > 1
    page.list_folder()
    wait_for(lambda: not shared_context.background.is_busy)
    assert page.table.chosen_paths() == chosen


def test_browsing_a_folder_does_not_change_the_folder_for_new_recordings(page, folder, tmp_path, wait_for):
    listed = page.table.recordings
    assert listed.entries
    page._folder_line.setText(str(tmp_path))
    page._typed_folder()
    # The old list is not shown under the name of the new folder.
    assert not listed.entries
    wait_for(lambda: page._count.text() == "0 recordings")
    assert page.context.folder == folder
    assert page._goes_to.text() == f"new recordings go to {folder}"
    page._folder_line.setText(str(folder))
    page._typed_folder()
    wait_for(lambda: len(listed.entries) >= 4)
    assert page._goes_to.text() == ""


@pytest.mark.parametrize("typed", ["9" * 300, "a\0b", "~nobody of that name/x"])
def test_an_impossible_folder_name_is_refused(page, typed):
    page._folder_line.setText(typed)
    page._typed_folder()
    assert page._folder_line.text() == str(page._folder)


def test_deleted_files_disappear_from_the_list_of_files(shared_context, record, tmp_path, wait_for, closing):
    gone, kept = record(tmp_path, "gone"), record(tmp_path, "kept")
    shared_context.choose_folder(tmp_path)
    page = closing(FilesPage(shared_context))
    page.list_folder()
    assert page.table.is_listing
    wait_for(lambda: len(page.table.recordings.entries) == 2)
    assert not page.table.is_listing
    gone.unlink()
    page._looked_s = 0.0
    page.refresh()
    wait_for(lambda: [each.path for each in page.table.recordings.entries] == [kept])
    wait_for(lambda: not shared_context.background.is_busy)


def test_the_text_of_a_forged_note_is_not_shown(record, tmp_path):
    path = add_note(record(tmp_path, "forged"), "glue was still wet")
    with h5py.File(path, "r+") as file:
        del file["results/note/settings_json"]
        file["results/note/settings_json"] = np.bytes_(b'{"text": "glue was dry"}')
    with open_recording(path) as recording:
        said = facts_text(recording, whole_check(path))
    assert "glue was dry" not in said
    assert "note: ✖ " in said
    assert "results that were changed after they had been saved: note" in said


def test_the_summary_of_a_recording_shows_its_state_once(begin_recording, tmp_path):
    writer, _ = begin_recording(tmp_path, "ended")
    path = writer.finish(RecordingState.STOPPED, "stopped by the operator, in the window")
    with open_recording(path) as recording:
        assert facts_text(recording, None).startswith("■ stopped by the operator, in the window")


def test_a_growing_file_shows_the_size_of_its_data_without_unused_space(begin_recording, tmp_path, wait_for):
    """A long run was shown as 512 MB one second after its start."""
    writer, part = begin_recording(tmp_path, "grows")
    wait_for(lambda: writer.committed_samples == 6400)
    (entry,) = read_listing(tmp_path).recordings
    assert entry.catalogue_entry.size_bytes == 3 * 6400 * 4 < part.stat().st_size
    writer.finish(RecordingState.COMPLETE, "the plan was carried out")


HINTS = (("broken.h5", "broken.h5"), ("whole.h5", "Reading|Working|Zoom in"), ("empty.h5", "no samples"))


@pytest.mark.parametrize(("name", "hint"), HINTS)
def test_no_hint_asks_for_a_recording_when_a_recording_is_selected(
    page, folder, tmp_path, name, hint, begin_recording
):
    path = folder / name
    if name == "empty.h5":
        writer = begin_recording(tmp_path, "empty", samples=0)[0]
        path = writer.finish(RecordingState.STOPPED, "stopped")
    page.open_path(path)
    for view in (page.pictures.hidden_motion, page.pictures.spectrogram):
        page.pictures.setCurrentWidget(view)
        page._open(path)
        assert "Choose a recording" not in view.plot._hint
        assert re.search(hint, view.plot._hint)
    page.pictures.setCurrentWidget(page.time_histories)


@pytest.mark.thorough
def test_the_wheel_zooms_the_spectrogram_and_the_cursor_shows_the_level(show_file, wait_for, qtbot):
    page = show_file("whole.h5")
    view = page.pictures.spectrogram
    page.pictures.setCurrentWidget(view)
    wait_for(lambda: not view.is_busy and view.image.item.image is not None)
    view.plot.reading.show_at(QPointF(5.0, np.log10(260.0)))
    assert re.search(r"-?\d+\.\d dB re 1 \(m/s\)²/Hz", view.plot.reading.text)
    before = page.time_histories.view_s
    box = view.plot.getViewBox()
    box.scaleBy(x=0.5)
    box.sigRangeChangedManually.emit(box.state["mouseEnabled"])
    after = page.time_histories.view_s
    assert after[1] - after[0] == pytest.approx(0.5 * (before[1] - before[0]), rel=0.01)
    wait_for(lambda: not view.is_busy)
    assert view.image.item.mapRectToParent(view.image.item.boundingRect()).width() < 6
    page.time_histories.show_all()
    page.pictures.setCurrentWidget(page.time_histories)


@pytest.mark.thorough
def test_recordings_can_be_exported_and_annotated(page, folder, tmp_path, wait_for, monkeypatch):
    path = tmp_path / "mine.h5"
    shutil.copyfile(folder / "whole.h5", path)
    notices = []
    page.context.noticed.connect(notices.append)
    page.open_path(path)
    wait_for(lambda: page.table.chosen_paths() == (path,))
    for ending in ("uff", "mat", "csv"):
        given = str(tmp_path / f"out.{ending}")
        monkeypatch.setattr(QFileDialog, "getSaveFileName", lambda *_, given=given, **__: (given, ""))
        page._export.click()
        wait_for((tmp_path / f"out.{ending}").exists)
    wait_for(lambda: len(notices) == 3)
    assert all(each.what.startswith("Written: ") for each in notices)
    for text in ("glue was still wet", "repeat it tomorrow"):
        monkeypatch.setattr(QInputDialog, "getMultiLineText", lambda *_, text=text: (text, True))
        page._note.click()
        wait_for(lambda text=text: f"note: {text}" in page._facts.sentence)
    assert "glue was still wet" in page._facts.sentence
    page._go_to(folder)
