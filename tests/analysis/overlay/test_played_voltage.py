"""The drive voltage is estimated from a recording with converter noise."""

import numpy as np
import pytest

from vibench.analysis.overlay.draws import PlayedVoltage, channel_noise

RATE = 25_600.0
TIME_S = np.arange(round(4 * RATE)) / RATE
# The tone is ramped on and off within the record, as in a plan, to limit its spectral leakage.
TONE_V = 0.06 * np.sin(2 * np.pi * 180.0 * TIME_S) * ((TIME_S > 0.7) & (TIME_S < 3.5))
BAND = (TIME_S > 1.5) & (TIME_S < 2.8)


def level(volts, low_hz=240.0, high_hz=290.0):
    """Power in a narrow band beside the tone, during the tone."""
    part = volts[BAND] * np.hanning(BAND.sum())
    frequency_hz = np.fft.rfftfreq(part.size, 1 / RATE)
    inside = (frequency_hz > low_hz) & (frequency_hz < high_hz)
    return np.mean(np.abs(np.fft.rfft(part)[inside]) ** 2)


@pytest.mark.parametrize(("played_rms", "own_rms"), [(5e-4, 4e-4), (2e-4, 4e-4), (5e-4, 1e-4)])
def test_converter_noise_is_removed_from_the_drive_of_the_twin(played_rms, own_rms):
    """With converter noise in the drive, a weak dwell was once 2 standard deviations off."""
    rng = np.random.default_rng(5)
    wanted, found, recorded = [], [], []
    for _ in range(12):
        played = TONE_V + played_rms * rng.standard_normal(TIME_S.size)
        volts = played + own_rms * rng.standard_normal(TIME_S.size)
        drawn = PlayedVoltage(volts, own_rms).random_voltage(rng)
        wanted.append(level(played))
        found.append(level(drawn))
        recorded.append(level(volts))
    # 12 records of 64 lines determine a mean power within 4 % and a ratio within 5 %.
    assert np.mean(found) == pytest.approx(np.mean(wanted), rel=0.15)
    if own_rms > 0.5 * played_rms:
        assert np.mean(recorded) > 1.4 * np.mean(wanted)


def test_simulated_draws_keep_the_recorded_drive_within_its_uncertainty():
    rng = np.random.default_rng(6)
    volts = TONE_V + 1e-4 * rng.standard_normal(TIME_S.size)
    voltage = PlayedVoltage(volts, 1e-4)
    one, other = voltage.random_voltage(rng), voltage.random_voltage(rng)
    tone = np.exp(-2j * np.pi * 180.0 * TIME_S[BAND])
    kept = np.mean(one[BAND] * tone) / np.mean(volts[BAND] * tone)
    assert kept == pytest.approx(1.0, abs=3e-4)
    assert 0.0 < np.std(one - other) < 2e-4


@pytest.mark.parametrize("samples", [7, 1000])
def test_a_short_or_noise_free_voltage_drives_the_twin_unchanged(samples):
    volts = TONE_V[20_000 : 20_000 + samples]
    rng = np.random.default_rng(7)
    np.testing.assert_array_equal(PlayedVoltage(volts, 0.0).random_voltage(rng), volts)
    assert PlayedVoltage(volts, 1e-9).random_voltage(rng).shape == volts.shape


def test_the_noise_of_a_channel_is_estimated_from_all_its_quiet_blocks():
    """The quietest of 240 blocks alone would be 9 to 12 % too low."""

    class Recorded:
        sample_rate_hz, samples = RATE, TIME_S.size
        volts = np.random.default_rng(8).standard_normal(TIME_S.size)

        def read(self, _role, start, stop):
            return self.volts[start:stop] * (1.0 + 20.0 * (start > self.samples // 2))

        def channel(self, _role):
            return self

        physical_per_volt = 2.0

    found = channel_noise(Recorded(), ("m0_velocity",))
    assert found.rms["m0_velocity"] == pytest.approx(1.0, rel=0.03)
    assert found.converter_v == pytest.approx(0.5, rel=0.03)
