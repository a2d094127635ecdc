import pytest
from hypothesis import given, strategies as st

from vibench.virtual_rig.generator.scpi_message import (
    AMPLITUDE_UNITS,
    FREQUENCY_UNITS,
    ErrorCode,
    ScpiError,
    as_number,
    block,
    boolean,
    number,
)


@pytest.mark.parametrize(
    ("text", "hertz"),
    [
        (b"1000", 1e3),
        (b"1.5kHz", 1.5e3),
        (b"1.5 KHZ", 1.5e3),
        (b"2MHz", 2e6),
        (b"2mhz", 2e6),
        (b"20uHz", 20e-6),
        (b"1e3Hz", 1e3),
        (b".5", 0.5),
    ],
)
def test_a_frequency_may_carry_its_unit_and_m_means_mega_before_hertz(text, hertz):
    assert number(text, FREQUENCY_UNITS) == pytest.approx(hertz, rel=1e-15)


@pytest.mark.parametrize(("text", "volts"), [(b"2.5VPP", 2.5), (b"50 mVpp", 0.05), (b"50mV", 0.05)])
def test_an_amplitude_in_millivolts_is_not_in_megavolts(text, volts):
    assert number(text, AMPLITUDE_UNITS) == pytest.approx(volts, rel=1e-15)


@pytest.mark.parametrize(
    ("text", "code"), [(b"1 V", ErrorCode.INVALID_SUFFIX), (b"fast", ErrorCode.DATA_TYPE_ERROR)]
)
def test_a_wrong_unit_and_a_wrong_word_are_refused_with_their_own_numbers(text, code):
    with pytest.raises(ScpiError) as refusal:
        number(text, FREQUENCY_UNITS)
    assert refusal.value.code is code


@pytest.mark.parametrize(("text", "state"), [(b"ON", True), (b"off", False), (b"1", True), (b"0", False)])
def test_a_switch_takes_words_and_numbers(text, state):
    assert boolean(text) is state


@pytest.mark.parametrize("text", [b"#15abcd", b"abcd", b"#2xx", b"#", b""])
def test_a_damaged_block_is_refused(text):
    with pytest.raises(ScpiError) as refusal:
        block(text)
    assert refusal.value.code is ErrorCode.INVALID_BLOCK_DATA


@given(st.floats(-1e37, 1e37, allow_nan=False).filter(lambda value: value == 0 or abs(value) > 1e-30))
def test_a_reply_keeps_twelve_digits(value):
    assert float(as_number(value)) == pytest.approx(value, rel=1e-11)


def test_infinity_reads_as_the_standard_asks():
    assert as_number(9.9e37) == b"9.9E+37"
    assert as_number(0.0) == b"0.0E+00"


@pytest.mark.parametrize("text", [b"1e999", b"-1e999", b"9e307kHz"])
def test_a_number_beyond_all_numbers_is_an_error_and_no_infinity(text):
    with pytest.raises(ScpiError) as refused:
        number(text, FREQUENCY_UNITS)
    assert refused.value.code is ErrorCode.EXPONENT_TOO_LARGE
