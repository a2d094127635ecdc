"""Rig and specimen driven by a sampled voltage: closed forms, continuity, sensors, sensitivity."""

from dataclasses import replace

import numpy as np
import pytest

from vibench.sim import base_transmissibility, gong2025
from vibench.sim.shaker.loaded_shaker import Amplifier
from vibench.sim.shaker.sampled_voltage import DrivenTable, follow_voltage

from .table_and_specimen import SHAKER, base_per_coil_volt

SPECIMEN = gong2025()
TABLE = DrivenTable(Amplifier(), SHAKER, SPECIMEN)


def complex_tones(samples, rate_hz, frequencies_hz):
    """Return least-squares amplitudes in the last second, with exp(+i w t) from the first sample."""
    count = round(rate_hz)
    time_s = (np.arange(samples.size) / rate_hz)[-count:]
    waves = np.exp(2j * np.pi * np.outer(time_s, frequencies_hz))
    weights, *_ = np.linalg.lstsq(np.hstack([waves.real, -waves.imag]), samples[-count:])
    return weights[: len(frequencies_hz)] + 1j * weights[len(frequencies_hz) :]


@pytest.mark.parametrize("rate_hz", [5120.0, 44_100.0])
def test_the_response_to_weak_tones_matches_the_closed_form_in_amplitude_and_phase(rate_hz):
    tones_hz = np.array([60.0, 94.0, 201.0, 310.0, 520.0])
    time_s = np.arange(round(7 * rate_hz)) / rate_hz
    volts = 1e-3 * np.sum(np.cos(2 * np.pi * np.outer(tones_hz, time_s)), axis=0)
    motion = follow_voltage(TABLE, volts, rate_hz)
    base = complex_tones(motion.base_acceleration[: -round(rate_hz)], rate_hz, tones_hz)
    m0 = complex_tones(motion.m0_velocity[: -round(rate_hz)], rate_hz, tones_hz)
    expected = 1e-3 * (2j * np.pi * tones_hz) ** 2 * base_per_coil_volt(tones_hz, SPECIMEN)
    np.testing.assert_allclose(base, expected, rtol=4e-5)
    through = base_transmissibility(SPECIMEN, tones_hz)[:, 0] / (2j * np.pi * tones_hz)
    np.testing.assert_allclose(m0, expected * through, rtol=4e-5)
    assert motion.impacts[-1] == 0


def test_a_long_recording_is_simulated_in_parts_without_seams():
    rate_hz = 44_100.0
    time_s = np.arange(300_000) / rate_hz
    volts = 1e-2 * np.cos(2 * np.pi * 150.0 * time_s) * (1 - np.exp(-(time_s**3)))
    motion = follow_voltage(TABLE, volts, rate_hz)
    # The sixth difference of a slow sine is negligible, and a step of 1e-7 would be visible.
    rough = np.abs(np.diff(motion.base_acceleration[5000:-5000], 6))
    assert rough.max() < 1e-5 * np.abs(motion.base_acceleration).max()


def test_a_simulated_recording_includes_the_response_of_its_sensors():
    rate_hz, tone_hz = 12_800.0, np.array([150.0])
    time_s = np.arange(round(5 * rate_hz)) / rate_hz
    volts = 1e-3 * np.cos(2 * np.pi * tone_hz[0] * time_s)
    late = replace(TABLE, m0_sensor=lambda f: np.exp(-2j * np.pi * f * 1e-4), base_low_cut_hz=20.0)
    plain, seen = (follow_voltage(each, volts, rate_hz) for each in (TABLE, late))
    m0 = [complex_tones(each.m0_velocity[:-6400], rate_hz, tone_hz)[0] for each in (plain, seen)]
    base = [complex_tones(each.base_acceleration[:-6400], rate_hz, tone_hz)[0] for each in (plain, seen)]
    assert np.angle(m0[1] / m0[0]) == pytest.approx(-2 * np.pi * 150 * 1e-4, abs=1e-4)
    assert base[1] / base[0] == pytest.approx(150j / (150j + 20), rel=1e-3)


def test_impacts_are_counted_and_depend_on_the_initial_state_to_a_nanometre():
    rate_hz = 51_200.0
    time_s = np.arange(round(2 * rate_hz)) / rate_hz
    volts = 2.5 * np.cos(2 * np.pi * 260 * time_s) * (time_s > 1.0)
    one, same, other = (
        follow_voltage(TABLE, volts, rate_hz, start=(start, 0, 0, 0, 0, 0)) for start in (0.0, 0.0, 1e-9)
    )
    begun = np.interp(1.0, one.impact_times_s, one.impacts)
    assert (begun, one.impacts[-1] > 200) == (0, True)
    np.testing.assert_array_equal(one.m0_velocity, same.m0_velocity)
    apart = np.abs(one.m0_velocity - other.m0_velocity)
    assert apart[: round(rate_hz)].max() < 1e-5
    assert apart[-round(0.3 * rate_hz) :].max() > 1e-2
