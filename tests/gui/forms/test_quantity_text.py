"""Common ways to write quantities are parsed, and displayed text parses to the same number."""

import pytest
from hypothesis import given, strategies as st
from PySide6.QtCore import Qt

from vibench.acquisition import ConfigurationError
from vibench.acquisition.plan import Dwell
from vibench.gui.forms.editor import ListEditor
from vibench.gui.forms.model_form import ValidatedForm
from vibench.gui.forms.quantity_edit import QuantityEdit, parse_quantity, quantity_text


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("12,5", "Hz", 12.5),
        ("2 kHz", "Hz", 2000.0),
        ("5 ms", "s", 0.005),
        ("45 µm", "m", 45e-6),
        ("45um", "m", 45e-6),
        ("1.5", "Vpp", 1.5),
        ("50 mVpp", "Vpp", 0.05),
        ("1e-3 s", "s", 1e-3),
        (" 7 ", "", 7.0),
    ],
)
def test_numbers_in_common_formats_are_parsed(text, unit, value):
    assert parse_quantity(text, unit) == value


@pytest.mark.parametrize(
    ("text", "unit"),
    [("5 Hz", "s"), ("fast", "Hz"), ("1.2.3", "V"), ("5 G", "m/s²"), ("5 g", "m"), ("", "s")],
)
def test_a_quantity_with_a_wrong_unit_or_word_is_refused(text, unit):
    with pytest.raises(ConfigurationError, match=r"number|unit"):
        parse_quantity(text, unit)


@given(st.floats(allow_nan=False, allow_infinity=False), st.sampled_from(["", "Hz", "m", "s", "Vpp", "m/s²"]))
def test_displayed_text_is_parsed_to_the_same_number(value, unit):
    assert parse_quantity(quantity_text(value, unit), unit) == value


def test_a_gap_is_shown_in_micrometres():
    assert quantity_text(45e-6, "m") == "45 µm"


def type_text(qtbot, edit, text, *keys):
    edit.setFocus()
    edit.lineEdit().setText(text)
    for key in keys or (Qt.Key.Key_Return,):
        qtbot.keyClick(edit, key)
    return edit.content()


@pytest.fixture
def field(closing):
    def make(unit, value, kind=float):
        edit = closing(QuantityEdit(unit, kind))
        edit.show()
        edit.show_content(value)
        return edit

    return make


@pytest.mark.parametrize(
    ("unit", "value", "taken"),
    [
        ("m", 5e-6, 7e-6),
        ("m", 2e-3, 7e-3),
        ("m", 1e-6 / 3, 7e-9),
        ("s", 5e-3, 7e-3),
        ("s", 0.5, 7.0),
        ("Vpp", 2e-3, 7e-3),
        ("V", 1.5, 7.0),
        ("Hz", 260.0, 7.0),
        ("m/s²", 0.3, 7.0),
        ("m", None, 7e-6),
    ],
)
def test_a_number_without_a_unit_is_in_the_displayed_unit(qtbot, field, unit, value, taken):
    edit = field(unit, value)
    assert type_text(qtbot, edit, "7") == taken
    assert edit.complaint == ""


def test_numbers_without_a_unit_in_a_list_are_in_the_displayed_unit(qtbot):
    editor = ListEditor("m", lambda: None)
    qtbot.addWidget(editor.widget)
    editor.show_content([5e-6, 2e-3])
    editor.widget.setText("7, 3, 4")
    assert editor.content() == [7e-6, 3e-3, 4e-3]


def test_a_value_1000_times_larger_than_before_must_be_confirmed(qtbot, field):
    edit = field("m", 5e-6)
    assert type_text(qtbot, edit, "7 mm") == 5e-6
    assert "1.4e+03 times" in edit.complaint
    assert "Return" in edit.complaint
    type_text(qtbot, edit, "7 mm", Qt.Key.Key_Tab)
    edit.clearFocus()
    assert edit.content() == 5e-6, "leaving the field does not confirm"
    assert type_text(qtbot, edit, "8 mm") == 5e-6, "another value is asked about again"
    assert type_text(qtbot, edit, "8 mm") == 8e-3
    assert edit.complaint == ""


def test_an_unconfirmed_value_does_not_enter_the_form(qtbot, closing, field):
    form = closing(ValidatedForm(Dwell, "dwell"))
    form.show_value(Dwell(amplitude_vpp=1.0, frequency_hz=260, duration_s=8.0))
    type_text(qtbot, form.form.editors["duration_s"].widget, "9000")
    assert form.value is None
    assert "press Return again" in form.complaint
    type_text(qtbot, form.form.editors["duration_s"].widget, "9000")
    assert form.value.duration_s == 9000.0
