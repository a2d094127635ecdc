"""Find hidden or cut-off widgets at a size, font and scale, with the longest texts everywhere."""

import json
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from PySide6.QtCore import QPoint, QRect
from PySide6.QtGui import QFont
from PySide6.QtWidgets import (
    QAbstractButton,
    QAbstractScrollArea,
    QApplication,
    QComboBox,
    QLabel,
    QLineEdit,
    QProgressBar,
    QScrollArea,
    QTabWidget,
    QWidget,
)

from vibench.gui.page.app_context import AppContext, Settings
from vibench.gui.widgets.notice import Notice, NoticeKind
from vibench.gui.widgets.theme import Tone
from vibench.gui.window.banner import StateIndicator, StatusField
from vibench.gui.window.window import PAGES, Window, application

SENTENCE = "Simulating; the first answer waits for the program to be made ready, and says so at length. " * 4
NAME = "a_recording_whose_name_was_chosen_by_somebody_who_likes_to_say_everything_in_it_" * 2
"""A long word that cannot be wrapped."""
SIZES = ((1024, 700), (1280, 720), (2560, 1440))
"""Sizes of the window at which its usual texts are complete."""


def fill_with_longest_texts(window):
    """Put long texts into every variable text: frame, labels, bars, fields and lists."""
    window._timer.stop()
    window.banner.show_indicator(StateIndicator("▼", "RAMPING DOWN", Tone.CAUTION, SENTENCE))
    window.strip.say(Notice(NoticeKind.FAULT, SENTENCE, NAME, SENTENCE))
    window.status_line.show_fields(dict.fromkeys(StatusField, NAME), frozenset(StatusField))
    for page in window.pages.values():
        buddies = {each.buddy() for each in page.findChildren(QLabel)} - {None}
        for label in page.findChildren(QLabel):
            is_changing = label.buddy() is None and label.property("rank") != "title"
            if is_changing and not isinstance(label.parent(), QAbstractButton):
                label.setText(SENTENCE + NAME)
        for bar in page.findChildren(QProgressBar):
            bar.setFormat(SENTENCE)
        for box in page.findChildren(QComboBox):
            blocked = box.blockSignals(True)
            box.setItemText(box.currentIndex(), SENTENCE)
            box.blockSignals(blocked)
        for line in page.findChildren(QLineEdit):
            blocked = line.blockSignals(True)
            line.setText(NAME)
            line.blockSignals(blocked)
        assert buddies or not page.findChildren(QLineEdit)


def place_in(widget, window):
    """Return the rectangle of a widget in window coordinates."""
    return QRect(widget.mapTo(window, QPoint(0, 0)), widget.size())


def is_whole(widget, window):
    """Return whether a widget is completely inside the window and its parents."""
    place, parent = place_in(widget, window), widget.parentWidget()
    while parent is not None and parent is not window:
        if not place_in(parent, window).contains(place):
            return False
        parent = parent.parentWidget()
    return window.rect().contains(place)


def scrolls_to(button, window):
    """Return how many areas must be scrolled to show a button; None if scrolling cannot show it."""
    moved = 0
    area = button.parentWidget()
    while area is not None and area is not window:
        if isinstance(area, QScrollArea):
            before = area.horizontalScrollBar().value(), area.verticalScrollBar().value()
            area.ensureWidgetVisible(button, 0, 0)
            moved += before != (area.horizontalScrollBar().value(), area.verticalScrollBar().value())
        area = area.parentWidget()
    return moved if is_whole(button, window) else None


def buttons_of(page):
    """Return the visible buttons of a page."""
    return [
        each
        for each in page.findChildren(QAbstractButton)
        if each.isVisible()
        and not isinstance(each.parent(), (QAbstractScrollArea, QLineEdit))
        and each.parent().metaObject().className() != "QTabBar"
    ]


def scroll_home(page):
    for area in page.findChildren(QScrollArea):
        area.verticalScrollBar().setValue(0)
        area.horizontalScrollBar().setValue(0)


def troubles_of(window, width, height, points):
    """Describe everything hidden on any page at a size and font."""
    font = QFont(QApplication.font())
    font.setPointSize(points)
    QApplication.setFont(font)
    QApplication.processEvents()
    while not window.is_themed:
        QApplication.processEvents()
    window.resize(width, height)
    found = []
    for name, page in window.pages.items():
        window.show_page(name)
        for tab in tabs_of(page):
            QApplication.processEvents()
            QApplication.processEvents()
            where = f"{name}{tab} at {width} x {height}, {points} pt"
            if (window.width(), window.height()) != (width, height):
                found.append(f"{where}: the window is {window.width()} x {window.height()}")
                window.resize(width, height)
            frame = (window.banner._stop, window.banner._label, window.status_line, window.strip)
            found += [
                f"{where}: {each.objectName() or each.accessibleName()} is cut, {place_in(each, window)}"
                for each in frame
                if not is_whole(each, window) or not window.isVisible()
            ]
            wanted = window.banner._stop.sizeHint().width()
            if window.banner._stop.width() < wanted:
                found.append(f"{where}: STOP is narrower than its words")
            for button in buttons_of(page):
                scroll_home(window)
                QApplication.processEvents()
                moved = scrolls_to(button, window)
                if moved is None or moved > 1:
                    said = button.accessibleName() or button.text()
                    found.append(f"{where}: {said!r} takes {moved} scrolls, {place_in(button, window)}")
    return found


def cut_off(window):
    for widget in window.findChildren(QWidget):
        if not widget.isVisible() or not isinstance(widget, QAbstractButton | QLabel):
            continue
        if isinstance(widget, QLabel) and (widget.wordWrap() or widget.sizePolicy().horizontalPolicy() == 13):
            continue
        # qt_ objects belong to Qt's widgets; labels without text show nothing.
        if widget.objectName().startswith("qt_") or not widget.text():
            continue
        if (
            widget.width() < widget.minimumSizeHint().width()
            or widget.height() < widget.minimumSizeHint().height()
        ):
            yield widget.text(), widget.size(), widget.minimumSizeHint()


def scrolled_sideways(page):
    """Return field columns that need horizontal scrolling; tables may scroll."""
    for area in page.findChildren(QScrollArea):
        if area.isVisible() and area.widget().minimumSizeHint().width() > area.viewport().width():
            yield area.accessibleName(), area.widget().minimumSizeHint().width(), area.viewport().width()


def cut_texts(window, width, height):
    """Describe every text that is cut off on any page at a size, and columns that do not fit."""
    window.resize(width, height)
    found = []
    for name, page in window.pages.items():
        window.show_page(name)
        QApplication.processEvents()
        where = f"{name} at {width} x {height}"
        if (window.width(), window.height()) != (width, height):
            found.append(f"{where}: the page needs more room")
        found += [f"{where}: {each} is cut off" for each in cut_off(window)]
        found += [f"{where}: {each} needs sideways scrolling" for each in scrolled_sideways(page)]
    return found


def tabs_of(page):
    """Show each tab of a page in turn; yield its name."""
    tabs = next((each for each in page.findChildren(QTabWidget) if each.parent() is page), None)
    if tabs is None:
        yield ""
        return
    for number in range(tabs.count()):
        tabs.setCurrentIndex(number)
        yield f", {tabs.tabText(number)}"


def main(cases):
    """Print everything hidden; `QT_SCALE_FACTOR` sets the scale."""
    app = application(["vibench"])
    with TemporaryDirectory() as folder:
        context = AppContext(Settings(Path(folder) / "window.ini"))
        context.choose_folder(Path(folder) / "recordings")
        window = Window(context, PAGES)
        window.show()
        app.processEvents()
        window.setUpdatesEnabled(False)  # painting takes half the time and moves nothing
        found = [each for size in SIZES for each in cut_texts(window, *size)]
        fill_with_longest_texts(window)
        found += [each for case in cases for each in troubles_of(window, *case)]
        window.close()
    print(json.dumps(found))  # noqa: T201 - output for the test


def wrongly_enabled(result):
    """Return the widgets that show an outdated result as if it were current."""
    return [each for each in result.widgets if result.is_outdated and each.isEnabled()]


if __name__ == "__main__":
    main(json.loads(sys.argv[1]))
