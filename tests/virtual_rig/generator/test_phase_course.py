from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, strategies as st

from vibench.virtual_rig.generator.terminal_voltage import Spacing, SteadyPhase, SweptPhase

DAY_S = 86_400.0
TIMES = st.floats(0, DAY_S)
FREQUENCIES = st.integers(1, 25_000_000_000_000)
"""Frequencies in microhertz."""


def turn(first, second):
    """Return the smallest distance between two phases [cycles]."""
    return abs((first - second + 0.5) % 1.0 - 0.5)


@given(frequency_uhz=FREQUENCIES, time_s=TIMES)
def test_a_day_at_25_mhz_shifts_the_phase_by_less_than_a_millionth_of_a_cycle(frequency_uhz, time_s):
    exact = Fraction(frequency_uhz, 1_000_000) * Fraction(time_s) % 1
    assert turn(SteadyPhase(frequency_uhz, 0.0).phase(time_s), float(exact)) < 1e-7


@given(first=FREQUENCIES, second=FREQUENCIES, time_s=TIMES)
def test_a_change_of_frequency_keeps_the_phase(first, second, time_s):
    before = SteadyPhase(first, 0.3)
    after = SteadyPhase.with_phase(second, before.phase(time_s), time_s)
    # 25 million cycles within a second have an error of 4e-9 cycles in double precision.
    assert turn(before.phase(time_s), after.phase(time_s)) < 2e-8


@pytest.mark.parametrize("spacing", Spacing)
def test_a_sweep_begins_at_its_start_frequency_and_ends_at_its_stop_frequency(spacing):
    sweep = SweptPhase(100.0, 900.0, 2.0, 1.0, spacing, begin_s=0.0, anchor_s=0.0, offset=0.0)
    edges = np.array([0.0, 1e-6, 1.0, 1.0 + 1e-6, 2.0 - 1e-6, 2.0])
    _, span = sweep.stretches(edges)
    rates = span[::2] / np.diff(edges)[::2]
    middle = 500.0 if spacing is Spacing.LINEAR else 300.0
    assert rates == pytest.approx([100.0, middle, 900.0], rel=1e-5)


def test_a_sweep_never_jumps_in_phase():
    sweep = SweptPhase(100.0, 900.0, 0.25, 0.5, Spacing.LINEAR, begin_s=0.1, anchor_s=0.0, offset=0.2)
    for turn_s in (0.1, 0.35, 0.85):
        assert turn(sweep.phase(turn_s - 1e-9), sweep.phase(turn_s + 1e-9)) < 5e-6
