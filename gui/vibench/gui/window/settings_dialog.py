"""Settings: all that the window remembers because somebody wants it so, in one form."""

from pathlib import Path
from typing import Annotated, Literal

from pydantic import AfterValidator, Field
from PySide6.QtGui import QFont
from PySide6.QtWidgets import QApplication, QDialog, QDialogButtonBox, QVBoxLayout, QWidget

from vibench.acquisition.engine import LONGEST_PATIENCE_S, VIEWER_PATIENCE_S
from vibench.sim import FrozenModel

from ..forms.model_form import JudgedForm
from ..page.app_context import AppContext, Remembered
from ..widgets.boxes import filled
from ..widgets.theme import THEMES
from ..widgets.units import UNITS


def whole_path(folder: str) -> str:
    """Take a path that means the same wherever the window was started."""
    if not Path(folder).expanduser().is_absolute():
        raise ValueError(f"{folder!r} is no whole path; give one such as {Path.home() / 'vibench'}")
    return folder


class Preferences(FrozenModel):
    """What somebody wants to have otherwise."""

    theme: Literal["light", "dark"]
    """Colours of the window; figures of exports are light."""
    font_pt: Annotated[int, Field(ge=7, le=24)]
    """Height of the letters."""
    displacements_in: Literal["automatic", "µm", "mm", "m"]
    """On axes, in fields, tables and sentences; files and reports keep their own. A field takes any unit."""
    velocities_in: Literal["mm/s", "m/s"]
    """On axes, in tables and sentences."""
    accelerations_in: Literal["m/s²", "g"]
    """g is 9.80665 m/s²."""
    patience_s: Annotated[float, Field(ge=VIEWER_PATIENCE_S, le=LONGEST_PATIENCE_S)]
    """How long a test far from every limit may go on while the window does not answer."""
    recordings_folder: Annotated[str, AfterValidator(whole_path)]
    """Where new recordings go."""


class SettingsDialog(QDialog):
    """Takes the settings over when they are allowed; Cancel leaves them."""

    def __init__(self, context: AppContext, parent: QWidget) -> None:
        super().__init__(parent)
        self.setWindowTitle("Settings")
        self._context = context
        self.form: JudgedForm[Preferences] = JudgedForm(Preferences, "settings")
        self.buttons = QDialogButtonBox(
            QDialogButtonBox.StandardButton.Ok | QDialogButtonBox.StandardButton.Cancel
        )
        self.buttons.accepted.connect(self.accept)
        self.buttons.rejected.connect(self.reject)
        filled(QVBoxLayout(self), self.form, self.buttons)
        self.setMinimumWidth(30 * self.fontMetrics().height())
        self.form.changed.connect(self._judge)
        self.form.show_value(
            Preferences(
                theme=context.theme.name,
                font_pt=QApplication.font().pointSize(),
                displacements_in=UNITS.chosen["m"],
                velocities_in=UNITS.chosen["m/s"],
                accelerations_in=UNITS.chosen["m/s²"],
                patience_s=context.patience_s,
                recordings_folder=str(context.folder),
            )
        )

    def accept(self) -> None:
        """Take the settings over, and keep them."""
        wanted = self.form.value
        if wanted is None:
            return
        if wanted.theme != self._context.theme.name:
            self._context.choose_theme(THEMES[wanted.theme])
        self._context.settings.keep_text(Remembered.PATIENCE, f"{wanted.patience_s:g}")
        self._context.settings.keep_text(Remembered.FONT, str(wanted.font_pt))
        self._context.choose_units(
            {"m": wanted.displacements_in, "m/s": wanted.velocities_in, "m/s²": wanted.accelerations_in}
        )
        font = QFont(QApplication.font())
        font.setPointSize(wanted.font_pt)
        QApplication.setFont(font)
        folder = Path(wanted.recordings_folder).expanduser()
        if folder != self._context.folder:
            self._context.choose_folder(folder)
        super().accept()

    def _judge(self) -> None:
        self.buttons.button(QDialogButtonBox.StandardButton.Ok).setEnabled(self.form.value is not None)
