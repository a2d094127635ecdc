"""Findings are written with unit prefixes without loss of digits."""

import pytest

from vibench.acquisition import Finding, Verdict
from vibench.gui.pages.rig import expected_text, finding_name, measured_text


def finding(number, unit, value="as the check says", uncertainty=None, advice=""):
    return Finding(
        name="noise of drive_voltage",
        value=value,
        expected="0.005 V or less",
        verdict=Verdict.WARN,
        number=number,
        uncertainty=uncertainty,
        unit=unit,
        advice=advice,
    )


@pytest.mark.parametrize(
    ("number", "unit", "text"),
    [
        (1.997e-05, "V", "20 µV"),
        (-9.5e-9, "V", "-9.5 nV"),
        (0.0001609, "s", "161 µs"),
        (2.5e6, "Hz", "2.5 MHz"),
        (0.5, "V", "as the check says"),
        (21.7, "h", "as the check says"),
        (None, "", "as the check says"),
        (0.0, "V", "as the check says"),
    ],
)
def test_small_and_large_values_of_findings_are_shown_with_unit_prefixes(number, unit, text):
    assert measured_text(finding(number, unit)) == text


def test_the_value_and_the_uncertainty_of_a_finding_share_one_unit_prefix():
    assert measured_text(finding(1.2e-3, "V", uncertainty=4e-5)) == "1.2 ± 0.04 mV"


def test_the_advice_of_a_finding_is_shown_after_its_expected_value():
    assert (
        expected_text(finding(1.0, "V", advice="look at the cable")) == "0.005 V or less. Look at the cable"
    )
    assert finding_name(finding(1.0, "V")) == "noise of drive voltage"
