"""Which two curves are compared, and how far they differ in all."""

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QFormLayout, QGroupBox, QLabel, QWidget

from vibench.analysis import AnalysisError, Difference, Trace, trace_difference

from ...forms import Choice

_NOBODY = "– nothing –"


class PairBox(QGroupBox):
    """A curve and its reference; by default the second one shown over the first."""

    changed = Signal()

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__("Difference in dB", parent)
        self._traces: dict[str, Trace] = {}
        self._curve, self._reference, self._said = Choice(), Choice(), QLabel("")
        form = QFormLayout(self)
        form.setFieldGrowthPolicy(QFormLayout.FieldGrowthPolicy.AllNonFixedFieldsGrow)
        for text, choice in (("C&urve", self._curve), ("Ov&er", self._reference)):
            label = QLabel(text)
            label.setBuddy(choice)
            choice.setAccessibleName(f"Difference: {text.replace('&', '').lower()}")
            choice.setSizeAdjustPolicy(Choice.SizeAdjustPolicy.AdjustToMinimumContentsLengthWithIcon)
            choice.setMinimumContentsLength(16)
            choice.currentIndexChanged.connect(lambda _index: self.changed.emit())
            form.addRow(label, choice)
        self._said.setProperty("rank", "second")
        self._said.setWordWrap(True)
        form.addRow(self._said)

    @property
    def said(self) -> str:
        """How far the two differ, or why that cannot be said."""
        return self._said.text()

    def offer(self, traces: tuple[Trace, ...], shown: tuple[Trace, ...]) -> None:
        """Let these be chosen; what was chosen stays."""
        self._traces = {each.name: each for each in traces}
        names = list(self._traces)
        for place, box in enumerate((self._reference, self._curve)):
            if names == [box.itemText(number) for number in range(1, box.count())]:
                continue
            chosen = box.currentText()
            blocked = box.blockSignals(True)
            box.clear()
            box.addItems([_NOBODY, *names])
            default = shown[place].name if len(shown) > 1 else _NOBODY
            box.setCurrentText(chosen if chosen in names else default)
            box.blockSignals(blocked)

    def pair(self) -> tuple[Trace, Trace] | None:
        """Give the curve and its reference, if both are chosen and differ."""
        curve, reference = (self._traces.get(box.currentText()) for box in (self._curve, self._reference))
        return None if curve is None or reference is None or curve is reference else (curve, reference)

    def difference(self) -> Difference | None:
        """Give how far they differ, and say it; None where nothing can be compared."""
        pair = self.pair()
        self._said.setText("")
        if pair is None:
            return None
        try:
            found = trace_difference(*pair)
        except AnalysisError as error:
            self._said.setText(str(error))
            return None
        self._said.setText(f"Median {found.median_abs_db:.2g} dB, root mean square {found.rms_db:.2g} dB")
        return found
