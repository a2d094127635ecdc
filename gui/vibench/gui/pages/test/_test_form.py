"""The form of one test, judged by the plan at every change."""

from pydantic import ValidationError
from PySide6.QtCore import Signal
from PySide6.QtWidgets import QGroupBox, QLabel, QScrollArea, QSizePolicy, QVBoxLayout, QWidget

from vibench.acquisition.plan import Measurement

from ...forms import Loc, ModelForm


class TestForm(QWidget):
    """Every value of a measurement; `measurement` is None while one of them is not allowed."""

    changed = Signal()

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.form = ModelForm(Measurement, hidden=frozenset({"repeats"}))
        limits = self.form.editors["limits"].widget
        assert isinstance(limits, QGroupBox)
        limits.setTitle("Limits  (1 = the rig's own)")
        self._measurement: Measurement | None = None
        self._complaint = QLabel()
        self._complaint.setProperty("rank", "complaint")
        self._complaint.setWordWrap(True)
        self._complaint.setAccessibleName("What is not allowed")
        inner = QWidget()
        layout = QVBoxLayout(inner)
        layout.setContentsMargins(0, 0, 8, 0)
        layout.addWidget(self.form)
        layout.addStretch(1)
        scroll = QScrollArea()
        scroll.setWidget(inner)
        scroll.setWidgetResizable(True)
        scroll.setFrameShape(QScrollArea.Shape.NoFrame)
        scroll.setSizePolicy(QSizePolicy.Policy.Preferred, QSizePolicy.Policy.Expanding)
        bar = scroll.verticalScrollBar().sizeHint().width()
        scroll.setMinimumWidth(inner.minimumSizeHint().width() + bar)
        outer = QVBoxLayout(self)
        outer.setContentsMargins(0, 0, 0, 0)
        outer.addWidget(scroll, 1)
        outer.addWidget(self._complaint)
        self.form.changed.connect(self._judge)

    @property
    def measurement(self) -> Measurement | None:
        """The test as it stands."""
        return self._measurement

    @property
    def complaint(self) -> str:
        """What is not allowed, all of it."""
        return self._complaint.text()

    def show_measurement(self, measurement: Measurement) -> None:
        """Show another test."""
        self.form.show_content(measurement.model_dump(mode="json", exclude_none=True))

    def _judge(self) -> None:
        complaints: dict[Loc, str] = {}
        try:
            self._measurement = Measurement.model_validate(self.form.content())
        except ValidationError as error:
            self._measurement = None
            complaints = {detail["loc"]: _sentence(detail["msg"]) for detail in error.errors()}
        self.form.complain(complaints)
        unread = self.form.unread
        if unread:
            self._measurement = None
        self._complaint.setText("; ".join([*complaints.values(), *unread]))
        self._complaint.setVisible(bool(complaints or unread))
        self.changed.emit()


def _sentence(text: str) -> str:
    return text.removeprefix("Value error, ")
