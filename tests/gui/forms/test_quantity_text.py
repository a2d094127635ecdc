"""What people type is read, and what is shown reads back as the same number."""

import pytest
from hypothesis import given, strategies as st

from vibench.acquisition import ConfigurationError
from vibench.gui.forms._quantity_edit import parsed_quantity, quantity_text


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
def test_numbers_are_read_as_people_write_them(text, unit, value):
    assert parsed_quantity(text, unit) == value


@pytest.mark.parametrize(
    ("text", "unit"),
    [("5 Hz", "s"), ("fast", "Hz"), ("1.2.3", "V"), ("5 G", "m/s²"), ("5 g", "m"), ("", "s")],
)
def test_other_units_and_words_are_refused(text, unit):
    with pytest.raises(ConfigurationError, match=r"number|unit"):
        parsed_quantity(text, unit)


@given(st.floats(allow_nan=False, allow_infinity=False), st.sampled_from(["", "Hz", "m", "s", "Vpp", "m/s²"]))
def test_what_is_shown_reads_back_as_the_same_number(value, unit):
    assert parsed_quantity(quantity_text(value, unit), unit) == value


def test_a_gap_is_shown_in_micrometres():
    assert quantity_text(45e-6, "m") == "45 µm"
