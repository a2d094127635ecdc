"""Sample ranges in which an input was overloaded."""

import numpy as np
import pytest

from vibench.acquisition import Overload
from vibench.acquisition.drivers._limits import overload_ranges


def ranges_of(row, first_sample=0, full_scale_v=1.0):
    return overload_ranges(np.array([row]), ("m0_velocity",), (full_scale_v,), first_sample)


def test_a_block_within_range_has_no_overload():
    assert ranges_of(0.949 * np.ones(100)) == ()


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_an_overload_range_includes_its_first_and_last_sample(sign):
    row = np.zeros(1000)
    row[10:20] = sign * 0.95
    assert ranges_of(row, first_sample=5000) == (Overload("m0_velocity", 5010, 5019),)


def test_short_pauses_do_not_end_an_overload_range():
    row = np.zeros(1000)
    row[[100, 164, 300]] = 1.0
    assert ranges_of(row) == (Overload("m0_velocity", 100, 164), Overload("m0_velocity", 300, 300))


def test_each_channel_is_checked_against_its_own_full_scale():
    volts = np.full((2, 10), 4.0)
    assert overload_ranges(volts, ("drive_voltage", "m0_velocity"), (5.0, 4.0), 0) == (
        Overload("m0_velocity", 0, 9),
    )
