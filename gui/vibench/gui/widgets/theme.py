"""Light and dark theme: colours of the window, of states and of curves."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum

from PySide6.QtGui import QColor, QPalette
from PySide6.QtWidgets import QApplication

_TITLE = 1.4
"""Font size of titles, relative to other text."""
Colour = str


class Tone(StrEnum):
    """Importance of a state or message, which determines the colour."""

    CALM = "calm"
    GOOD = "good"
    ACTIVE = "active"
    CAUTION = "caution"
    DANGER = "danger"


@dataclass(frozen=True)
class Paint:
    """Background and text colour, with a contrast ratio of at least 4.5."""

    ground: Colour
    letters: Colour


@dataclass(frozen=True)
class Theme:
    """All colours of a theme."""

    name: str
    window: Colour
    base: Colour
    raised: Colour
    """Background colour of buttons and headers."""
    line: Colour
    """Colour of the borders of groups and grids."""
    edge: Colour
    """Borders of input fields, with a contrast ratio of at least 3."""
    text: Colour
    muted: Colour
    accent: Colour
    tones: Mapping[Tone, Paint]
    traces: tuple[Colour, ...]
    """Colours of curves in order of use: the colours of Okabe and Ito, adapted to the background."""
    predicted: Colour
    """Colour of simulated curves; these curves are dashed as well."""


_STRONG_TONES = {
    Tone.GOOD: Paint("#00694d", "#ffffff"),
    Tone.ACTIVE: Paint("#005a94", "#ffffff"),
    Tone.CAUTION: Paint("#f0c445", "#14181f"),
    Tone.DANGER: Paint("#b3261e", "#ffffff"),
}
LIGHT = Theme(
    name="light",
    window="#f3f4f6",
    base="#ffffff",
    raised="#e6e9ee",
    line="#b9c0ca",
    edge="#7a838f",
    text="#14181f",
    muted="#4a5361",
    accent="#005a94",
    tones={Tone.CALM: Paint("#dfe3e9", "#14181f"), **_STRONG_TONES},
    traces=("#0072b2", "#c77700", "#009e73", "#d55e00", "#aa4f8d", "#2f8fc4"),
    predicted="#5b6470",
)
DARK = Theme(
    name="dark",
    window="#1b1f26",
    base="#12151a",
    raised="#2a303a",
    line="#4b5563",
    edge="#77828f",
    text="#eceff4",
    muted="#aeb8c6",
    accent="#6cbcf0",
    tones={Tone.CALM: Paint("#343b46", "#eceff4"), **_STRONG_TONES},
    traces=("#56b4e9", "#e69f00", "#23c297", "#f0844c", "#dd9cc4", "#f0e442"),
    predicted="#b3bcc8",
)
THEMES = {theme.name: theme for theme in (LIGHT, DARK)}


def palette(theme: Theme) -> QPalette:
    """Return the palette of a theme for Qt's widgets; a palette, not a colour scheme, works everywhere."""
    role = QPalette.ColorRole
    colours = QPalette()
    for where, colour in (
        (role.Window, theme.window),
        (role.WindowText, theme.text),
        (role.Base, theme.base),
        (role.AlternateBase, theme.window),
        (role.ToolTipBase, theme.raised),
        (role.ToolTipText, theme.text),
        (role.PlaceholderText, theme.muted),
        (role.Text, theme.text),
        (role.Button, theme.raised),
        (role.ButtonText, theme.text),
        (role.Highlight, theme.accent),
        (role.HighlightedText, theme.base),
        (role.Link, theme.accent),
        (role.Mid, theme.edge),
    ):
        colours.setColor(where, QColor(colour))
    for where in (role.WindowText, role.Text, role.ButtonText):
        colours.setColor(QPalette.ColorGroup.Disabled, where, QColor(theme.muted))
    return colours


def style_sheet(theme: Theme) -> str:
    """Return style rules that a palette cannot express: panels, navigation bar, banner; sizes follow fonts.

    A table with focus has a coloured frame, because a shaded cell would be harder to read.
    """
    tones = "".join(
        f'*[tone="{tone.value}"] {{ background: {paint.ground}; color: {paint.letters}; }}\n'
        for tone, paint in theme.tones.items()
    )
    return f"""
QToolTip {{ color: {theme.text}; background: {theme.raised}; border: 1px solid {theme.line}; }}
QGroupBox {{ border: 1px solid {theme.line}; border-radius: 4px; margin-top: 0.7em; padding-top: 0.5em; }}
QGroupBox::title {{ subcontrol-origin: margin; left: 0.7em; padding: 0 0.3em; color: {theme.text}; }}
QFrame#banner, QFrame#statusLine {{ background: {theme.base}; }}
QLabel#engine_state {{ border-radius: 4px; padding: 0.35em 0.9em; font-weight: bold; }}
QPushButton#stop {{ background: {theme.tones[Tone.DANGER].ground}; color: {theme.tones[Tone.DANGER].letters};
    border: 2px solid {theme.tones[Tone.DANGER].ground}; border-radius: 4px; font-weight: bold;
    padding: 0.35em 1.4em; }}
QPushButton#stop:focus {{ border-color: {theme.text}; }}
QListWidget#rail {{ background: {theme.window}; border: none; outline: none; }}
QListWidget#rail::item {{ padding: 0.55em 0.8em; border-left: 4px solid transparent; color: {theme.text}; }}
QListWidget#rail::item:selected {{ background: {theme.base}; border-left: 4px solid {theme.accent};
    color: {theme.text}; font-weight: bold; }}
QLabel[rank="second"] {{ color: {theme.muted}; }}
QLabel[rank="title"] {{ font-size: {round(_TITLE * QApplication.font().pointSize())}pt; font-weight: bold; }}
QLabel[rank="complaint"] {{ color: {"#a11d16" if theme is LIGHT else "#ff9d94"}; }}
QPushButton[rank="first"] {{ background: {theme.accent}; color: {theme.base};
    border: 2px solid {theme.accent}; border-radius: 4px; padding: 0.35em 1.2em; font-weight: bold; }}
QPushButton[rank="first"]:disabled {{ background: {theme.raised}; color: {theme.muted};
    border-color: {theme.line}; }}
QPushButton[rank="first"]:focus {{ border-color: {theme.text}; }}
QCheckBox::indicator:unchecked, QListView::indicator:unchecked {{ border: 1px solid {theme.muted};
    border-radius: 2px; background: {theme.base}; }}
QTableView {{ outline: none; border: 1px solid {theme.line}; }}
QTableView:focus {{ border-color: {theme.accent}; }}
QHeaderView::section {{ background: {theme.raised}; color: {theme.text}; border: none;
    border-right: 1px solid {theme.line}; padding: 0.3em 0.5em; }}
{tones}"""
