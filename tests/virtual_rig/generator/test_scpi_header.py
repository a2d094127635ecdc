import pytest
from hypothesis import given, strategies as st

from vibench.virtual_rig.generator.scpi_message import HeaderPath, HeaderPattern, mnemonic_matches

AMPLITUDE = HeaderPattern("[SOURce#:]VOLTage[:LEVel][:IMMediate][:AMPLitude]")


@pytest.mark.parametrize(
    ("header", "channel"),
    [
        ("VOLT", 1),
        ("SOUR:VOLT", 1),
        ("SOUR1:VOLT", 1),
        ("source2:voltage:level:immediate:amplitude", 2),
        ("SOURCE2:VOLT:AMPL", 2),
        ("Sour2:Volt:Lev", 2),
    ],
)
def test_optional_nodes_and_both_forms_in_any_case_are_the_same_command(header, channel):
    assert AMPLITUDE.match(header) == channel


@pytest.mark.parametrize("header", ["VOLTA", "SOURC1:VOLT", "VOL", "VOLT:AMPL:LEV", "SOUR1VOLT", "VOLT:"])
def test_anything_between_short_and_long_form_is_another_command(header):
    assert AMPLITUDE.match(header) is None


@given(st.sampled_from(["SINusoid", "TRIGgered", "MINimum"]), st.randoms())
def test_case_never_matters(mnemonic, random):
    word = "".join(random.choice((letter.lower(), letter.upper())) for letter in mnemonic)
    assert mnemonic_matches(word, mnemonic)


def test_a_header_after_a_semicolon_counts_from_the_last_branch():
    full, path = HeaderPath().resolve("SOUR1:VOLT:OFFS")
    assert full == "SOUR1:VOLT:OFFS"
    full, path = path.resolve("AMPL")
    assert full == "SOUR1:VOLT:AMPL"
    full, path = path.resolve("*OPC")
    assert full == "*OPC"
    full, path = path.resolve("OFFS")
    assert full == "SOUR1:VOLT:OFFS"
    full, _ = path.resolve(":OUTP1:STAT")
    assert full == "OUTP1:STAT"
