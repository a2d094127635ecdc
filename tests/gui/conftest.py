"""The window as it is, offscreen, with settings of its own."""

import numpy as np
import pytest
from PySide6.QtCore import QEvent
from PySide6.QtGui import QColor

from gui.app import application
from gui.desk import Desk
from gui.pages.catalogue import PAGES
from gui.settings import Settings
from gui.window import Window


@pytest.fixture(scope="session")
def qapp():
    """The application as `vibench gui` makes it."""
    return application(["vibench"])


@pytest.fixture
def desk(qapp, tmp_path):
    desk = Desk(Settings(tmp_path / "window.ini"))
    yield desk
    desk.background.close()


@pytest.fixture(scope="session")
def contrast():
    """Ratio of luminances of two colours (WCAG 2.1, section 1.4.3); text needs 4.5."""

    def luminance(name):
        colour = QColor(name)
        parts = (colour.redF(), colour.greenF(), colour.blueF())
        linear = [part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts]
        return float(np.dot((0.2126, 0.7152, 0.0722), linear))

    def ratio(letters, ground):
        bright, dark = sorted((luminance(letters), luminance(ground)), reverse=True)
        return (bright + 0.05) / (dark + 0.05)

    return ratio


@pytest.fixture(scope="module")
def own_state(tmp_path_factory):
    """Keep locks out of the user's folder."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("VIBENCH_STATE_DIR", str(tmp_path_factory.mktemp("state")))
        yield


@pytest.fixture
def window(desk, own_state, tmp_path, qapp):
    """The whole window, without a bench."""
    desk.choose_folder(tmp_path / "recordings")
    window = Window(desk, PAGES)
    window.resize(1280, 720)
    window.show()
    yield window
    end(window, qapp)


def end(window, qapp):
    """Close a window, and let Qt forget it: thousands of old widgets would slow down the next one."""
    window.desk.bridge.close()
    window.close()
    window.deleteLater()
    qapp.sendPostedEvents(None, QEvent.Type.DeferredDelete.value)
    qapp.processEvents()
