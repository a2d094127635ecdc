"""`--frequency` accepts a number or a range and refuses other text with a reason."""

import pytest

from vibench.analysis import InvalidRequest
from vibench.cli.scene_options import frequencies


def test_a_number_is_one_frequency_and_a_range_includes_both_ends():
    assert frequencies("260") == (260.0,)
    assert frequencies("10:11:0.5") == (10.0, 10.5, 11.0)
    assert frequencies("10:10:1") == (10.0,)
    assert frequencies("10:30:10") == (10.0, 20.0, 30.0)


@pytest.mark.parametrize(
    ("typed", "why", "way"),
    [
        ("600:10:1", "600 is not below 10", "START:STOP:STEP"),
        ("10:600:0", "0 is not above 0", "START:STOP:STEP"),
        ("10:600:-1", "-1 is not above 0", "START:STOP:STEP"),
        ("600:10:-1", "-1 is not above 0", "START:STOP:STEP"),
        ("abc", "'abc' is not a number", "one above 0 Hz"),
        ("10:abc:1", "'abc' is not a number", "START:STOP:STEP"),
        ("10:600", "2 numbers are not allowed", "START:STOP:STEP"),
        ("10:600:1:2", "4 numbers are not allowed", "START:STOP:STEP"),
        ("0:600:1", "0 is not above 0", "one above 0 Hz"),
        ("-5", "-5 is not above 0", "one above 0 Hz"),
        ("inf", "'inf' is not finite", "one above 0 Hz"),
        ("10:nan:1", "'nan' is not finite", "START:STOP:STEP"),
        ("1:1e9:1e-3", "1e+12 values is too long: at most 1000000", "give a larger step"),
        ("", "'' is not a number", "one above 0 Hz"),
    ],
)
def test_an_invalid_frequency_list_is_refused_with_a_reason_and_a_remedy(typed, why, way):
    with pytest.raises(InvalidRequest) as refused:
        frequencies(typed)
    said = str(refused.value)
    assert said.startswith(f"--frequency was given as {typed!r}: ")
    assert why in said
    assert way in said
    assert "{" not in said
