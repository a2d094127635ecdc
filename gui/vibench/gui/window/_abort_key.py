"""Esc and Pause abort from anywhere in the window, from modal dialogs and open menus too."""

from PySide6.QtCore import QEvent, QObject, Qt, Signal
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QApplication

ABORT_KEYS = frozenset({Qt.Key.Key_Escape, Qt.Key.Key_Pause})


class AbortKey(QObject):
    """Hears every key press of the application before any widget does.

    A shortcut is not heard while a modal dialog is open; a filter on the application is. The key goes
    on to whoever has the focus, so that Esc still closes a dialog.
    """

    pressed = Signal()

    def __init__(self, application: QApplication, parent: QObject) -> None:
        super().__init__(parent)
        self._last_seen: tuple[int, int] | None = None
        application.installEventFilter(self)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Listen, and let everything pass."""
        if event.type() is QEvent.Type.KeyRelease:
            self._last_seen = None
        elif event.type() in (QEvent.Type.KeyPress, QEvent.Type.ShortcutOverride):
            assert isinstance(event, QKeyEvent)
            if event.key() in ABORT_KEYS and not event.isAutoRepeat() and self._is_new(event):
                self.pressed.emit()
        return super().eventFilter(watched, event)

    def _is_new(self, event: QKeyEvent) -> bool:
        """One press comes by several times: as an override, at the window, and at its widget."""
        seen = (event.timestamp(), event.key())
        is_new = seen != self._last_seen
        self._last_seen = seen
        return is_new
