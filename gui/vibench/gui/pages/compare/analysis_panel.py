"""How recordings are analysed, next to the picture that it makes, and how far the analysis is."""

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QGroupBox, QPushButton, QVBoxLayout

from vibench.analysis import AnalysisOptions

from ...forms.model_form import JudgedForm
from ...widgets.boxes import filled, row
from ...widgets.timed_bar import TimedBar


class AnalysisPanel(QGroupBox):
    """The options, the button that applies them, and a bar while it is done."""

    wanted = Signal()
    """Analyse all recordings anew."""
    cancelled = Signal()

    def __init__(self) -> None:
        super().__init__("Analysis")
        self.form = JudgedForm(AnalysisOptions, "analysis")
        self._again = QPushButton("Anal&yse again")
        self._again.setAccessibleName("Analyse again")
        self._again.setToolTip("Analyse all recordings with these options")
        self._again.clicked.connect(lambda _checked=False: self.wanted.emit())
        self._bar = TimedBar("Recordings analysed", "analysed")
        self._cancel = QPushButton("Cance&l")
        self._cancel.setAccessibleName("Cancel the analysis")
        self._cancel.setToolTip("Forget what has not been analysed yet")
        self._cancel.clicked.connect(lambda _checked=False: self.cancelled.emit())
        filled(QVBoxLayout(self), self.form, row(self._again, (self._bar, 1), self._cancel))
        for widget in (self._bar, self._cancel):
            # Their place is kept: what begins or ends must move nothing.
            policy = widget.sizePolicy()
            policy.setRetainSizeWhenHidden(True)
            widget.setSizePolicy(policy)
        self.form.changed.connect(self._judge)
        self.show_progress(0, 0)

    def options(self) -> AnalysisOptions | None:
        """Give the options; None while they are not allowed, which the form then says."""
        return self.form.value

    def show_progress(self, done: int, asked: int) -> None:
        """Say how many recordings are analysed; the bar is there only while some are not."""
        self._bar.show_done(done, asked)
        for widget in (self._bar, self._cancel):
            widget.setVisible(done < asked)

    def _judge(self) -> None:
        self._again.setEnabled(self.form.value is not None)
