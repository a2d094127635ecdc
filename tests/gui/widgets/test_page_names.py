"""Whoever cannot see the pages hears every part of them, and every key of a page does one thing."""

import re

import pytest
from PySide6.QtWidgets import (
    QAbstractButton,
    QComboBox,
    QLabel,
    QLineEdit,
    QProgressBar,
    QTableView,
    QTabWidget,
)

from vibench.gui.pages.compare.compare_page import ComparePage
from vibench.gui.pages.files.files_page import FilesPage
from vibench.gui.pages.simulate.simulate_page import SimulatePage

PAGES = (FilesPage, ComparePage, SimulatePage)
MENU_KEYS = "ftvh"


@pytest.fixture(params=PAGES, ids=lambda each: each.__name__)
def page(request, context, qtbot):
    page = request.param(context)
    qtbot.addWidget(page)
    page.resize(1200, 700)
    page.show()
    return page


def own(page, *kinds):
    """Widgets of our own making: Qt's inner ones speak for themselves."""
    found = [each for kind in kinds for each in page.findChildren(kind)]
    return [each for each in found if not each.objectName().startswith("qt_") and each.isVisibleTo(page)]


def test_every_part_that_takes_the_focus_has_a_name(page):
    parts = own(page, QAbstractButton, QComboBox, QTableView, QProgressBar, QTabWidget)
    nameless = [
        each
        for each in parts
        if each.focusPolicy() and not each.accessibleName() and not getattr(each, "text", lambda: "")()
    ]
    assert parts
    assert [type(each).__name__ for each in nameless] == []


def test_every_key_of_a_page_does_one_thing_and_none_is_a_menus(page):
    texts = [each.text() for each in own(page, QAbstractButton)]
    texts += [each.text() for each in own(page, QLabel) if each.buddy() is not None]
    for tabs in own(page, QTabWidget):
        texts += [tabs.tabText(number) for number in range(tabs.count())]
    keys = [found[1].lower() for text in texts if (found := re.search("&([^&])", text))]
    assert len(keys) == len(set(keys)), sorted(keys)
    assert not set(keys) & set(MENU_KEYS)


def test_no_button_cuts_its_text(page):
    for button in own(page, QAbstractButton):
        assert button.width() >= button.minimumSizeHint().width() or not button.text()


def test_every_field_has_a_label_or_a_name(page):
    for field in own(page, QLineEdit):
        assert field.accessibleName() or field.parentWidget().accessibleName()
