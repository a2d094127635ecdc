"""The two pictures of a recording: its channels over time, and the frequencies that one of them holds."""

from PySide6.QtWidgets import QTabWidget, QWidget

from vibench.analysis.live import RecordingOverview

from ...background import Background
from ...widgets import Theme
from ._lanes import RecordingLanes
from ._spectrogram_view import SpectrogramView


class Pictures(QTabWidget):
    """Both show the same stretch of the same recording."""

    def __init__(self, theme: Theme, background: Background, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setAccessibleName("Pictures of the recording")
        self.setDocumentMode(True)
        self.lanes = RecordingLanes(theme)
        self.spectrogram = SpectrogramView(theme, background)
        self.addTab(self.lanes, "Tim&e")
        self.addTab(self.spectrogram, "&Spectrogram")
        self.lanes.range_changed.connect(lambda: self.spectrogram.show_view(*self.lanes.view_s))

    def show_recording(self, overview: RecordingOverview | None) -> None:
        """Show another recording, or none."""
        self.spectrogram.show_recording(None if overview is None else overview.recording)
        self.lanes.show_recording(overview)
        self.spectrogram.show_view(*self.lanes.view_s)

    def retheme(self, theme: Theme) -> None:
        """Draw in other colours."""
        self.lanes.retheme(theme)
        self.spectrogram.retheme(theme)
