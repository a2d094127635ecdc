"""Compare: curves of recordings and predictions, overlaid, with peaks, differences and exports."""

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QFileDialog, QGroupBox, QTabWidget, QVBoxLayout, QWidget

from vibench.acquisition.recording import copy_sentence, first_copies
from vibench.analysis import AnalysisOptions, ComparedRecording, Curve, compare_recording
from vibench.analysis.dynamics import branch_curves
from vibench.sim.background import Job

from ...forms.model_form import ValidatedForm
from ...page.app_context import AppContext
from ...page.page import FileKind, Page, SideAndPicture
from ...widgets.boxes import TimedBar, column, fill_box, keep_space, new_path, push_button, row, splitter
from ...widgets.notice import COMPARE, Notice, NoticeKind
from .curve_plots import (
    PEAK_HEADINGS,
    CurveList,
    CurvePlots,
    NumberTable,
    PairBox,
    marker_headings,
    marker_rows,
    peak_rows,
)


def export_comparison(
    path: Path,
    curves: tuple[Curve, ...],
    recordings: tuple[ComparedRecording, ...],
    pair: tuple[Curve, Curve] | None,
    markers_hz: tuple[float, ...],
) -> Path:
    """Write the comparison to ``path``, in the format of its suffix; return the path of the file."""
    from vibench.analysis.report import write_comparison  # noqa: PLC0415 - loading it takes most of a second

    return write_comparison(path, curves, recordings, pair, markers_hz)


class AnalysisPanel(QGroupBox):
    """Box with the analysis options, the button that applies them, and the progress bar."""

    wanted = Signal()
    """Emitted to analyse all recordings again with the current options."""
    cancelled = Signal()

    def __init__(self) -> None:
        super().__init__("Analysis")
        self.form = ValidatedForm(AnalysisOptions, "analysis")
        self._again = push_button(
            "Anal&yse again", "Analyse all recordings with these options", self.wanted.emit
        )
        self._bar = TimedBar("Recordings analysed", "analysed")
        self._cancel = push_button("Cance&l", "Cancel the remaining analyses", self.cancelled.emit)
        self._cancel.setAccessibleName("Cancel the analysis")
        fill_box(QVBoxLayout(self), self.form, row(self._again, (self._bar, 1), self._cancel))
        for widget in (self._bar, self._cancel):
            keep_space(widget)
        self.form.changed.connect(self._validate)
        self.show_progress(0, 0)

    def show_progress(self, done: int, total: int) -> None:
        """Show how many recordings have been analysed; hide the bar when all are analysed."""
        self._bar.show_done(done, total)
        for widget in (self._bar, self._cancel):
            widget.setVisible(done < total)

    def _validate(self) -> None:
        self._again.setEnabled(self.form.value is not None)


REPORT = "Report (*.html)"
FILTERS = f"SVG (*.svg);;PDF (*.pdf);;PNG (*.png);;Numbers as CSV (*.csv);;{REPORT}"


class ComparePage(Page):
    """Page with a list of curves on the left, their plot on the right, and numbers below the plot."""

    def __init__(self, context: AppContext) -> None:
        super().__init__(context)
        self.curves = CurveList(context.theme)
        self.plots = CurvePlots(context.theme)
        self.panel = AnalysisPanel()
        self.pair_box = PairBox()
        self.peaks = NumberTable("Peaks of the curves", "Frequency, height and damping of each peak.")
        self.readings = NumberTable(
            "Curves at the markers", "Show the markers (Alt+M) to read the ticked curves at two frequencies."
        )
        self._recordings: dict[Path, ComparedRecording | None] = {}
        self._jobs: list[Job] = []
        self._total = 0
        fill_box(QVBoxLayout(self), SideAndPicture(context, COMPARE, self._side(), self._picture()))
        self.curves.changed.connect(self._draw)
        self.pair_box.changed.connect(self._draw)
        self.plots.markers.moved.connect(self._read)
        self.panel.wanted.connect(self.analyse_again)
        self.panel.cancelled.connect(self.cancel)
        context.comparison_requested.connect(self.add_recordings)
        context.prediction_made.connect(self.add_prediction)

    @property
    def is_done(self) -> bool:
        """Whether at least two curves are overlaid."""
        return len(self.curves.ticked_curves()) > 1

    @property
    def is_busy(self) -> bool:
        """Whether recordings are being analysed."""
        return bool(self._jobs)

    @property
    def opens(self) -> Mapping[FileKind, Callable[[Path], object]]:
        """Function that opens files written by `vibench branches`."""
        return {FileKind.BRANCHES: lambda path: self.add_branches((path,))}

    def add_recordings(self, paths: tuple[Path, ...]) -> None:
        """Analyse recordings in the background, then overlay their curves."""
        options = self.panel.form.value
        if options is None:
            return
        for path in paths:
            self._recordings.setdefault(path, None)
            self._total += 1
            self._jobs.append(
                self.context.background.ask(
                    compare_recording,
                    self._add_recording,
                    self._show_error,
                    path,
                    options.request,
                    options.model,
                )
            )
        self._say_progress()

    def add_prediction(self, curves: tuple[Curve, ...]) -> None:
        """Overlay the curves of a prediction on the plotted curves."""
        for source in dict.fromkeys(each.source for each in curves):
            self.curves.replace_source(source, tuple(each for each in curves if each.source == source))

    def analyse_again(self) -> None:
        """Analyse every recording with the current options."""
        self.cancel()
        self.add_recordings(tuple(self._recordings))

    def cancel(self) -> None:
        """Cancel the analyses that are not finished."""
        for job in self._jobs:
            job.drop()
        self._jobs.clear()
        self._total = 0
        self._say_progress()

    def export_to(self, path: Path) -> None:
        """Write the comparison in the background, in the format of the path's suffix."""
        shown = tuple(each for each, _ in self.curves.ticked_curves())
        recordings = tuple(each for each in self._recordings.values() if each is not None)
        pair = None if self.pair_box.difference() is None else self.pair_box.pair()
        marked = self.plots.markers.values
        ask = self.context.background.ask
        ask(export_comparison, self._say_done, self.context.fail, path, shown, recordings, pair, marked)

    def _add_recording(self, found: ComparedRecording) -> None:
        others = [each for path, each in self._recordings.items() if each is not None and path != found.path]
        if (first := first_copies([*others, found])[-1]) < len(others):
            self._recordings.pop(found.path, None)  # absent if this path was requested twice
            text = copy_sentence(others[first], str(others[first].path), found)
            self.context.warn(f"{found.path} {text}.", "It is shown once.")
            self._end_job()
            return
        self._recordings[found.path] = found
        self.curves.replace_source(found.name, found.curves)
        for sentence in found.failures:
            self.context.warn(sentence, "Only the measured curves are shown.")
        self._end_job()

    def _show_error(self, error: BaseException) -> None:
        self._recordings = {path: each for path, each in self._recordings.items() if each is not None}
        self.context.fail(error)
        self._end_job()

    def _end_job(self) -> None:
        self._jobs = [job for job in self._jobs if not job.is_over]
        self._say_progress()

    def _say_progress(self) -> None:
        if not self._jobs:
            self._total = 0
        self.panel.show_progress(self._total - len(self._jobs), self._total)

    def _say_done(self, path: Path) -> None:
        self.context.say(Notice(NoticeKind.INFO, f"Written: {path}"))

    def _draw(self) -> None:
        shown = self.curves.ticked_curves()
        self.pair_box.offer(self.curves.curves, tuple(each for each, _ in shown))
        self.plots.show_curves(shown, self.pair_box.difference())
        self.peaks.show_numbers(PEAK_HEADINGS, peak_rows(tuple(each for each, _ in shown)))
        self._export.setEnabled(bool(shown))
        self._report.setEnabled(bool(shown))
        self._read()

    def _read(self) -> None:
        markers_hz = self.plots.markers.values
        curves = tuple(each for each, _ in self.curves.ticked_curves()) if markers_hz else ()
        self.readings.show_numbers(marker_headings(markers_hz), marker_rows(curves, markers_hz))

    def _choose_recordings(self) -> None:
        chosen, _ = QFileDialog.getOpenFileNames(
            self, "Recordings to compare", str(self.context.folder), "Recordings (*.h5 *.h5.part)"
        )
        if chosen:
            self.add_recordings(tuple(Path(each) for each in chosen))

    def _choose_branches(self) -> None:
        chosen, _ = QFileDialog.getOpenFileNames(
            self, "Branches to overlay on recordings", str(self.context.folder), "Branches (*.h5)"
        )
        self.add_branches(tuple(Path(each) for each in chosen))

    def add_branches(self, paths: tuple[Path, ...]) -> None:
        """Read files written by `vibench branches` in the background, then overlay their curves."""
        for path in paths:
            self.context.background.ask(branch_curves, self.add_prediction, self.context.fail, path)

    def _remove(self) -> None:
        gone = set(self.curves.remove_chosen())
        self._recordings = {
            path: each for path, each in self._recordings.items() if each is None or each.name not in gone
        }

    def _choose_export(self, filters: str = FILTERS) -> None:
        wish = self.context.folder / ("comparison.html" if filters == REPORT else "comparison.svg")
        if (path := new_path(self, "Export", wish, filters)) is not None:
            self.export_to(path)

    def _side(self) -> QWidget:
        add = push_button("&Add recordings…", "Choose recordings to compare", self._choose_recordings)
        branches = push_button(
            "&Branches…", "Choose files written by vibench branches", self._choose_branches
        )
        remove = push_button("&Remove", "Remove the selected curves", self._remove)
        self.curves.setMinimumHeight(6 * self.fontMetrics().height())
        return column(row(add, branches, remove), (self.curves, 1), self.pair_box, self.panel)

    def _picture(self) -> QWidget:
        tabs = QTabWidget()
        tabs.setAccessibleName("Numbers")
        tabs.addTab(self.peaks, "&Peaks")
        tabs.addTab(self.readings, "At the mar&kers")
        vertical = splitter("Picture and numbers", self.plots, tabs, (560, 170))
        vertical.setStretchFactor(0, 1)
        self._markers = push_button("&Markers", "Read the curves at two markers", lambda: None)
        self._markers.setCheckable(True)
        self._markers.toggled.connect(self.plots.markers.show)
        self._markers.toggled.connect(lambda is_on: tabs.setCurrentIndex(int(is_on)))
        show_all = push_button(
            "Sho&w all", "Fit the axes to all curves", self.plots.magnitudes.show_everything
        )
        self._export = push_button("E&xport…", "Write picture, numbers or report", self._choose_export)
        self._report = push_button(
            "Report…",
            "Write an HTML page with curves, peaks and recordings",
            partial(self._choose_export, REPORT),
        )
        self._export.setEnabled(False)
        self._report.setEnabled(False)
        return column((vertical, 1), row(1, self._markers, show_all, self._report, self._export))
