"""A button that says what it does: text with a key, a tip, and a name for screen readers."""

from collections.abc import Callable

from PySide6.QtWidgets import QPushButton


def push_button(text: str, tip: str, act: Callable[[], object]) -> QPushButton:
    """Make one; ``act`` is called without what Qt tells of it."""
    button = QPushButton(text)
    button.setToolTip(tip)
    button.setAccessibleName(text.replace("&", "").rstrip("…"))
    button.clicked.connect(lambda _checked=False: act())
    return button
