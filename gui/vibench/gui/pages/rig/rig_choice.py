"""Which hardware configuration: those that come with vibench, and one's own files."""

import warnings
from pathlib import Path

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import QFileDialog, QFormLayout, QLabel, QPushButton, QWidget

from vibench.acquisition import ConfigurationError, all_shipped, printable
from vibench.acquisition.rig import Rig, load_rig
from vibench.sim import SpecimenWarning

from ...forms.editor import Choice
from ...widgets.elided_label import plain_tip

PACES = {"wall": "in real time, as a bench would", "free": "as fast as this computer can"}
"""How fast a simulated bench runs."""


class RigChoice(QWidget):
    """Names of configurations; what cannot be read is said and not chosen."""

    chosen = Signal()
    refused = Signal(object)
    """The ConfigurationError of a file that cannot be read."""

    def __init__(self) -> None:
        super().__init__()
        self._paths: list[Path] = []
        self._rig: Rig | None = None
        self._complaint = self._warning = ""
        self._box = Choice()
        self._box.setAccessibleName("Hardware configuration")
        self._box.setToolTip("What hangs on this computer; a simulated rig runs anywhere")
        own = QPushButton("Own file…")
        own.setToolTip("Open a hardware configuration of your own")
        own.clicked.connect(self._ask)
        self.pace = Choice()
        self.pace.setAccessibleName("Pace of the simulated rig")
        self.pace.setToolTip("How fast the simulated instruments run; a real bench has its own pace")
        for words in PACES.values():
            self.pace.addItem(words)
        self._form = QFormLayout(self)
        self._form.setContentsMargins(0, 0, 0, 0)
        for text, line, buddy in (
            ("Configuration", self._box, self._box),
            ("Runs", self.pace, self.pace),
        ):
            label = QLabel(text)
            label.setBuddy(buddy)
            self._form.addRow(label, line)
        self._form.addRow(own)
        for path in sorted(all_shipped("hardware_configs"), key=lambda each: "virtual" not in each.stem):
            self._add(path)
        self._box.currentIndexChanged.connect(self._load)
        self.pace.currentIndexChanged.connect(self.chosen)

    @property
    def path(self) -> Path | None:
        """The chosen file."""
        row = self._box.currentIndex()
        return self._paths[row] if 0 <= row < len(self._paths) else None

    @property
    def complaint(self) -> str:
        """Why the chosen file cannot be used; empty where it can."""
        return self._complaint

    @property
    def warning(self) -> str:
        """What its specimen may not be meant to be."""
        return self._warning

    @property
    def rig(self) -> Rig | None:
        """The chosen rig, at the chosen pace."""
        if self._rig is None or self._rig.virtual is None:
            return self._rig
        pace = list(PACES)[self.pace.currentIndex()]
        return self._rig.model_copy(update={"virtual": self._rig.virtual.model_copy(update={"pace": pace})})

    def choose(self, path: Path) -> None:
        """Choose a file, listed or not."""
        if path not in self._paths:
            self._add(path)
        row = self._paths.index(path)
        if row == self._box.currentIndex():
            self._load()
        else:
            self._box.setCurrentIndex(row)

    def _add(self, path: Path) -> None:
        self._paths.append(path)
        self._box.addItem(printable(path.stem.replace("_", " ")))
        self._box.setItemData(self._box.count() - 1, plain_tip(str(path)), Qt.ItemDataRole.ToolTipRole)

    def _ask(self) -> None:
        given, _ = QFileDialog.getOpenFileName(self, "Hardware configuration", "", "Configurations (*.toml)")
        if given:
            self.choose(Path(given))

    def _load(self) -> None:
        path = self.path
        self._rig, self._complaint, self._warning = None, "", ""
        if path is not None:
            with warnings.catch_warnings(record=True, action="always", category=SpecimenWarning) as warned:
                try:
                    self._rig = load_rig(path)
                except ConfigurationError as error:
                    self._complaint = str(error)
                    self.refused.emit(error)
            self._warning = "; ".join(str(each.message) for each in warned)
        is_simulated = self._rig is not None and self._rig.virtual is not None
        self._form.setRowVisible(1, is_simulated)
        self.chosen.emit()
