"""A sign of life for the engine while the window paints: that may take longer than it waits."""

from PySide6.QtCore import QEvent, QObject
from PySide6.QtWidgets import QApplication

from ._bridge import Bridge


class SignOfLife(QObject):
    """Tells the engine, at every picture that is painted, that the window has not frozen.

    It acts in the window's own thread, and only when that gets something done: a frozen window is
    as silent with it as without it.
    """

    def __init__(self, application: QApplication, bridge: Bridge, parent: QObject) -> None:
        super().__init__(parent)
        self._bridge = bridge
        application.installEventFilter(self)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Look at what is painted, and let everything pass."""
        if event.type() is QEvent.Type.Paint:
            self._bridge.beat()
        return super().eventFilter(watched, event)
