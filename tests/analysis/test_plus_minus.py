"""A value is rounded to the decimal places of its uncertainty, which has two digits."""

import re

import numpy as np
import pytest
from hypothesis import given, strategies as st

from vibench.analysis.tables import plus_minus


@pytest.mark.parametrize(
    ("value", "half_width", "text"),
    [
        (132.512345, 4e-5, "132.512345 ± 0.000040"),
        (94.6134, 0.0123, "94.613 ± 0.012"),
        (1.3333, 0.0996, "1.33 ± 0.10"),
        (2.448, 0.3, "2.45 ± 0.30"),
        (-7.0, 2.0, "-7.0 ± 2.0"),
        (12345.6, 987.0, "12350 ± 990"),
        (5.0, 99.7, "0 ± 100"),
        (1.5e-9, 2.345e-11, "(1.500 ± 0.023)e-9"),
        (4.5e9, 1.23e8, "(4.50 ± 0.12)e9"),
        (5e-324, 5e-324, "(4.9 ± 4.9)e-324"),
        (1.5e308, 2e307, "(1.50 ± 0.20)e308"),
        (0.4473, 0.0, "0.4473"),
        (0.4473, np.nan, "0.4473"),
        (0.4473, np.inf, "0.4473"),
    ],
)
def test_a_value_is_rounded_to_the_digits_of_its_uncertainty(value, half_width, text):
    assert plus_minus(value, half_width) == text


@given(
    st.floats(-1e6, 1e6).filter(lambda x: abs(x) > 1e-3),
    st.floats(1e-9, 1e5),
)
def test_rounding_a_value_to_its_uncertainty_loses_only_insignificant_digits(value, half_width):
    read, bound = (
        float(each) for each in re.fullmatch(r"(\S+) ± (\S+)", plus_minus(value, half_width)).groups()
    )
    assert bound == pytest.approx(half_width, rel=0.05)
    assert abs(read - value) <= 0.051 * half_width + 1e-9 * abs(value)
