"""The window frame: page keys, themes, kept settings, and nothing armed after a start."""

import pytest
from PySide6.QtCore import Qt

from vibench.gui.page.app_context import AppContext, Settings
from vibench.gui.page.page import PageParts
from vibench.gui.plots.plot import Plot
from vibench.gui.widgets.notice import FILES, TEST
from vibench.gui.widgets.theme import DARK, LIGHT
from vibench.gui.window.window import PAGES, Window


@pytest.mark.thorough
def test_every_page_opens_with_its_shortcut(lasting_window, qtbot):
    for number, name in enumerate(lasting_window.pages, start=1):
        qtbot.keyClick(lasting_window, getattr(Qt.Key, f"Key_{number}"), Qt.KeyboardModifier.ControlModifier)
        assert lasting_window.page is lasting_window.pages[name], name


@pytest.mark.thorough
def test_the_pages_are_in_the_order_of_the_work_steps(lasting_window):
    names = list(PAGES)
    assert list(lasting_window.pages) == names
    assert names[:3] == ["Rig", "Test", "Run"]


def parts_of(window, page):
    """The two parts of a page."""
    return window.pages[page].findChild(PageParts)


@pytest.mark.thorough
def test_a_restart_restores_the_theme_the_page_and_the_test_without_arming(window, qapp, own_state, tmp_path):
    window.context.choose_theme(DARK)
    window.show_page(TEST)
    form = window.pages[TEST].form.form
    form.show_content({**form.content(), "name": "kept"})
    for page in (FILES, TEST):
        window.show_page(page)
        parts_of(window, page).setSizes([300, 500])
        parts_of(window, page).splitterMoved.emit(300, 1)
    divided = {page: parts_of(window, page).saveState() for page in (FILES, TEST)}
    window.close()
    again = Window(AppContext(Settings(tmp_path / "window.ini")), PAGES)
    assert again.context.theme is DARK
    assert again.page is again.pages[TEST]
    assert again.context.selection.measurement.name == "kept"
    assert again.banner.indicator.word == "NO BENCH"
    assert {page: parts_of(again, page).saveState() for page in divided} == divided
    again.close()
    again.deleteLater()


def test_the_banner_and_the_stop_button_are_visible_on_every_page(lasting_window, qapp):
    for name in lasting_window.pages:
        lasting_window.show_page(name)
        qapp.processEvents()
        assert lasting_window.banner.isVisible(), name


@pytest.mark.parametrize("theme", [DARK, LIGHT], ids=lambda theme: theme.name)
def test_every_plot_follows_the_theme(lasting_window, qtbot, theme):
    lasting_window.context.choose_theme(theme)
    qtbot.waitUntil(lambda: lasting_window.is_themed, timeout=60_000)
    for name, page in lasting_window.pages.items():
        for plot in page.findChildren(Plot):
            assert plot.backgroundBrush().color().name() == theme.base, (name, plot.accessibleName())
    assert len(lasting_window.findChildren(Plot)) > 10


@pytest.mark.thorough
@pytest.mark.parametrize("order", ["arm_test", "start", "check"])
def test_a_command_that_needs_a_bench_shows_the_next_step(lasting_window, order):
    page, notices = lasting_window.page, lasting_window.strip.notices
    getattr(lasting_window.user_actions, order)()
    (newest,) = lasting_window.strip.notices[len(notices) :]
    assert newest.next_step
    assert lasting_window.page is page
