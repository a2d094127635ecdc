"""The level of a terminal band equals the amplitude of the tone in it."""

from dataclasses import replace

import numpy as np
import pytest

from vibench.analysis import analyse
from vibench.analysis.sine.dwell_analysis import terminal_levels


def test_a_terminal_level_is_the_line_amplitude_relative_to_the_drive_line(dwell_file):
    response = analyse(dwell_file("weak")).response
    motion = response.displacement
    line_m = abs(response.order_displacement[response.orders.index(1.0)])
    time_s = np.arange(motion.samples.size) / motion.sample_rate_hz
    added = motion.samples + 0.1 * line_m * np.sin(2 * np.pi * 200.0 * time_s)
    with_line = replace(response, displacement=replace(motion, samples=added))
    found = terminal_levels(with_line, (201.5, 260.0))
    assert [each.towards_hz for each in found] == [201.5]
    assert found[0].decibel == pytest.approx(-20.0, abs=0.2)
    assert found[0].peak_hz == pytest.approx(200.0, abs=2.0)
