"""The list of excitations is grouped and explained; each kind starts with a name and valid values."""

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QStyleOptionViewItem

from vibench.acquisition.plan import EXCITATION_KINDS, preview_measurement
from vibench.acquisition.rig import load_rig
from vibench.gui.pages.test import test_page as _test_form
from vibench.gui.pages.test.test_page import shipped_tests

RIG = load_rig("virtual_rig")


@pytest.fixture
def form(qapp, closing):
    form = closing(_test_form.TestForm())
    form.show_value(shipped_tests()[0].measurement)
    return form


def choose(form, word):
    """Choose a kind as a user does."""
    box = form.form.editors["excitation"].kind_choice
    place = box.findData(word)
    box.setCurrentIndex(place)
    box.activated.emit(place)


def test_kinds_of_excitation_are_grouped_below_headings_and_explained(form):
    box = form.form.editors["excitation"].kind_choice
    flags = [box.model().item(place).flags() for place in range(box.count())]
    headings = [box.itemText(n) for n, each in enumerate(flags) if not each & Qt.ItemFlag.ItemIsEnabled]
    assert headings == ["NOISE", "SWEEP", "DWELL", "STEPS", "FEEDBACK"]
    assert {box.itemData(place) for place in range(box.count())} == {None, *EXCITATION_KINDS}
    option = QStyleOptionViewItem()
    index = box.model().index(box.findData("dwell"), 0)
    box.view().itemDelegate().initStyleOption(option, index)
    assert option.text.strip() == "dwell:  A sine at one frequency, recorded after it has settled."
    assert box.currentData() == form.value.excitation.kind


def test_selecting_a_heading_does_not_change_the_kind_of_excitation(form):
    box = form.form.editors["excitation"].kind_choice
    kind = form.value.excitation.kind
    box.setCurrentIndex(box.findText("STEPS"))
    assert (box.currentData(), form.value.excitation.kind) == (kind, kind)


@pytest.mark.parametrize("word", EXCITATION_KINDS)
def test_a_newly_chosen_excitation_gets_a_name_and_values_within_the_limits_of_the_rig(form, word):
    choose(form, "dwell" if word != "dwell" else "white_noise")
    choose(form, word)
    assert form.value is not None, form.complaint
    assert form.value.name == word
    seen = preview_measurement(form.value, RIG)
    assert seen.is_allowed, [each.complaint() for each in seen.checks if not each.is_kept]


def test_each_kind_of_excitation_remembers_its_own_duration(form):
    choose(form, "sine_sweep")
    choose(form, "dwell")
    form.form.editors["excitation"].form.editors["duration_s"].widget.show_content(3.0)
    form.form.changed.emit()
    choose(form, "sine_sweep")
    assert form.value.excitation.duration_s == 60.0
    choose(form, "dwell")
    assert form.value.excitation.duration_s == 3.0
    assert form.value.name == "dwell"


def test_showing_a_saved_test_does_not_change_it(form):
    named = next(each for each in shipped_tests() if each.measurement.excitation.kind == "sine_sweep")
    form.show_value(named.measurement)
    assert form.value == named.measurement
