"""Hammer hits in an imported recording: bounds are correct, also with an exponential window."""

import numpy as np
import pytest
from scipy.io import savemat

from vibench.analysis import FrequencyResponseRequest, Simulation, analyse, analyse_files, budgets_of
from vibench.analysis.exchange import ImportMapping, import_recording

RATE = 5120.0
MODES = ((80.0, 0.01, 2.0), (210.0, 0.01, 1.0))
"""Natural frequency [Hz], damping ratio and modal mass [kg]."""
MAPPING = {
    "started_utc": "2026-03-01T12:00:00Z",
    "sample_rate_hz": RATE,
    "channels": [
        {"source": "force", "role": "drive_voltage"},
        {"source": "force", "role": "base_acceleration"},
        {"source": "velocity", "role": "m0_velocity"},
    ],
    "measurement": {
        "name": "hits",
        "excitation": {
            "kind": "streamed_noise", "amplitude_vpp": 1.0, "band_start_hz": 40, "band_stop_hz": 400,
            "settle_s": 0,
        },
    },
}  # fmt: skip


def mobility(frequency_hz):
    s = 2j * np.pi * np.asarray(frequency_hz)
    return sum(s / m / (s**2 + 2 * d * w * s + w**2) for hz, d, m in MODES for w in [2 * np.pi * hz])


def hammering(count, seed, apart_s=1.5, noise=0.002, free_kg=np.inf):
    """Return force (2 ms half sines at irregular times) and exact velocity with noise."""
    rng = np.random.default_rng(seed)
    time_s = np.arange(round((count * apart_s + 0.2) * RATE)) / RATE
    force = np.zeros(time_s.size)
    for number in range(count):
        at = time_s - 0.1 - apart_s * number - rng.uniform(0, 0.1)
        force += rng.uniform(100, 300) * np.where((at > 0) & (at < 2e-3), np.sin(np.pi * at / 2e-3), 0)
    velocity = np.zeros(time_s.size)
    # Circular convolution, zero-padded to eight times the record length.
    lines_hz = np.fft.rfftfreq(8 * time_s.size, 1 / RATE)
    velocity = np.fft.irfft(np.fft.rfft(force, 8 * time_s.size) * mobility(lines_hz))[: time_s.size]
    velocity += np.cumsum(force) / (RATE * free_kg)
    return force, velocity + noise * np.max(np.abs(velocity)) * rng.standard_normal(time_s.size)


def import_hits(folder, force, velocity):
    savemat(folder / "hits.mat", {"force": force, "velocity": velocity})
    mapping = ImportMapping.model_validate(MAPPING)
    plan = mapping.measurement.excitation.model_copy(update={"duration_s": force.size / RATE})
    measurement = mapping.measurement.model_copy(update={"excitation": plan})
    mapping = mapping.model_copy(update={"measurement": measurement})
    return import_recording(folder / "hits.mat", mapping, folder / "hits.h5")


MAPPING["measurement"]["excitation"]["duration_s"] = 1.0


def test_a_single_hammer_hit_gives_resonances_without_bounds(tmp_path):
    """Segments without a hit once gave bounds, which were wrong."""
    (result,) = analyse_files([import_hits(tmp_path, *hammering(1, 1))], "hits", Simulation.LEFT_OUT).results
    found = result.analysis.response
    assert np.all(np.isinf(found.frequency_response.half_width))
    assert not found.frequency_response.is_significant.any()
    for each, (frequency_hz, damping, _) in zip(found.resonances, MODES, strict=True):
        assert each.frequency_hz == pytest.approx(frequency_hz, rel=1e-3)
        assert each.damping_ratio == pytest.approx(damping, rel=0.1)
        assert np.isinf(each.sd_damping_ratio)
    budgets = budgets_of(result)
    assert len(budgets) == 3 * len(MODES)
    assert all("noise" in [cause.value for cause in each.not_stated] for each in budgets)
    (said,) = (each.text for each in result.analysis.checks if each.what == "Hits")
    assert "no result has bounds" in said


@pytest.mark.thorough
def test_the_damping_of_an_exponential_window_is_subtracted(tmp_path):
    """Segments are shorter than the response; the exponential window adds twice the damping of mode 1."""
    request = FrequencyResponseRequest(segment_s=0.3)
    found = analyse(import_hits(tmp_path, *hammering(6, 2)), request).response
    assert found.hits == 6
    how = found.frequency_response.settings
    assert how.decay_per_s / (2 * np.pi * 80.0) > 2 * 0.01
    for each, (frequency_hz, damping, _) in zip(found.resonances, MODES, strict=True):
        assert abs(each.frequency_hz - frequency_hz) < 3 * each.sd_frequency_hz
        assert abs(each.damping_ratio - damping) < 3 * each.sd_damping_ratio
        assert each.sd_damping_ratio < 0.1 * damping
        about_hz = np.arange(0.98, 1.02, 1e-5) * frequency_hz
        peak = np.max(2 * np.pi * about_hz * np.abs(mobility(about_hz)))
        assert abs(each.peak_magnitude - peak) < 3 * each.sd_peak_magnitude


@pytest.mark.thorough
def test_the_bounds_for_the_modes_of_a_free_body_hold_and_are_narrow(tmp_path):
    """The step of the velocity once gave chi² = 0.02, and bounds up to six times wider."""
    found = analyse(import_hits(tmp_path, *hammering(6, 5, noise=1e-4, free_kg=2.0))).response
    for each, (frequency_hz, damping, _) in zip(found.resonances, MODES, strict=True):
        assert abs(each.frequency_hz - frequency_hz) < 3 * each.sd_frequency_hz
        assert abs(each.damping_ratio - damping) < 3 * each.sd_damping_ratio
        assert each.sd_damping_ratio < 1.5e-4 * damping
