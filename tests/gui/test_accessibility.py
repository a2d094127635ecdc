"""Widgets that take the focus have names, mnemonics are unique, and fields have visible edges."""

import re
from collections import Counter

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import (
    QAbstractButton,
    QAbstractScrollArea,
    QAbstractSpinBox,
    QComboBox,
    QLabel,
    QLineEdit,
    QMenu,
    QTabWidget,
    QWidget,
)

from vibench.gui.widgets.theme import DARK, LIGHT

FIELDS = (QLineEdit, QAbstractSpinBox, QComboBox)
NAMED_BY_TEXT = (QAbstractButton, QLabel)


def inside(widget, kinds):
    return any(isinstance(parent, kinds) for parent in parents(widget))


def parents(widget):
    while (widget := widget.parentWidget()) is not None:
        yield widget


def focusable(window):
    for widget in window.findChildren(QWidget):
        own = not widget.objectName().startswith("qt_") and not isinstance(
            widget.parentWidget(), QAbstractScrollArea
        )
        part_of_another = inside(widget, (QComboBox, QAbstractSpinBox, QTabWidget)) and isinstance(
            widget, QLineEdit | QAbstractScrollArea
        )
        if own and widget.focusPolicy() & Qt.FocusPolicy.TabFocus and not part_of_another:
            yield widget


@pytest.mark.thorough
def test_every_widget_that_takes_the_focus_has_an_accessible_name(lasting_window):
    nameless = []
    for widget in focusable(lasting_window):
        text = widget.text() if isinstance(widget, NAMED_BY_TEXT) else ""
        if not (widget.accessibleName() or text) and type(widget).__name__ not in ("QTabBar", "QScrollArea"):
            nameless.append((type(widget).__name__, widget.parentWidget().accessibleName()))
    assert nameless == []


def test_every_page_and_tab_has_an_accessible_name(lasting_window):
    for name, page in lasting_window.pages.items():
        assert page.accessibleName() == f"{name} page"
    for tabs in lasting_window.findChildren(QTabWidget):
        for number in range(tabs.count()):
            assert tabs.tabText(number)
            assert tabs.widget(number).accessibleName()


def mnemonic(text):
    found = re.search(r"&([^&\s])", text)
    return found[1].upper() if found else None


def test_mnemonics_are_unique_in_each_menu_and_on_each_page(lasting_window):
    bar = [mnemonic(action.text()) for action in lasting_window.menuBar().actions()]
    for name, page in lasting_window.pages.items():
        on_page = [mnemonic(button.text()) for button in page.findChildren(QAbstractButton)]
        twice = [key for key, count in Counter(filter(None, (*bar, *on_page))).items() if count > 1]
        assert twice == [], name
    for menu in lasting_window.menuBar().findChildren(QMenu):
        keys = Counter(filter(None, (mnemonic(action.text()) for action in menu.actions())))
        assert max(keys.values(), default=1) == 1, menu.title()


def test_keyboard_shortcuts_are_unique(lasting_window):
    keys = [
        action.shortcut().toString()
        for menu in lasting_window.menuBar().findChildren(QMenu)
        for action in menu.actions()
        if not action.shortcut().isEmpty()
    ]
    assert len(keys) == len(set(keys))
    assert all(len(key) > 1 for key in keys), "a bare letter must start nothing"


@pytest.mark.thorough
@pytest.mark.parametrize("theme", [LIGHT, DARK], ids=lambda theme: theme.name)
def test_every_field_has_a_visible_edge(lasting_window, qapp, qtbot, contrast, theme):
    """WCAG 2.1, section 1.4.11: contrast of at least 3 with the inside and the outside."""
    lasting_window.context.choose_theme(theme)
    qtbot.waitUntil(lambda: lasting_window.is_themed, timeout=60_000)
    faint, looked_at = [], 0
    for name in lasting_window.pages:
        lasting_window.show_page(name)
        qapp.processEvents()
        for field in lasting_window.page.findChildren(QWidget):
            is_field = isinstance(field, FIELDS) and not inside(field, FIELDS)
            if not is_field or not field.isVisible() or not field.isEnabled():
                continue
            picture = field.grab().toImage()
            sides = [(0, picture.height() // 2), (picture.width() // 2, picture.height() - 1)]
            edges = [picture.pixelColor(*side).name() for side in sides]
            looked_at += 1
            if min(contrast(edge, ground) for edge in edges for ground in (theme.base, theme.window)) < 3:
                faint.append((name, field.accessibleName(), edges))
    assert faint == []
    assert looked_at > 20
