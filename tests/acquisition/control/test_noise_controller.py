"""Noise equalised at the base on the virtual rig, judged by Welch's method from the recording."""

import json

import numpy as np
import pytest
from scipy.signal import welch

from vibench.acquisition import LimitExceeded, open_bench, open_recording, run_measurement
from vibench.acquisition.excitation.noise import HeldNoise, SpectrumPoint, density_at
from vibench.acquisition.plan import Measurement

BAND = {"band_start_hz": 40, "band_stop_hz": 400, "repetition_hz": 2, "settle_s": 0.3}
RESOLUTION_HZ = 8.0


def corners(*pairs):
    return tuple(SpectrumPoint(frequency_hz=hz, density=density) for hz, density in pairs)


def noise(**changes):
    usual = {"amplitude_vpp": 4.0, "spectrum": corners((40, 0.01)), "realisations": 4, "equalisations": 3}
    return HeldNoise(**{**BAND, **usual, **changes})


@pytest.fixture
def record_noise(rig, tmp_path):
    """Return a function that carries out noise on the virtual rig and opens the recording."""

    def record(excitation, **believed):
        daq = rig.daq.model_copy(update={"sample_rate_hz": 10240.0})
        plan = Measurement(name="noise", excitation=excitation, ramp_s=0.3, ramp_step_s=0.03)
        path = tmp_path / "noise.h5"
        with open_bench(rig.model_copy(update={"daq": daq})) as bench:
            # The simulated shaker exists already; this changes only the controller's model of the shaker.
            bench.rig = bench.rig.model_copy(update={"shaker": rig.shaker.model_copy(update=believed)})
            run_measurement(bench, plan, path)
        return open_recording(path)

    return record


def densities(recording, role):
    """Return frequencies and mean density of a channel over all realisations [Hz, unit2/Hz]."""
    rate_hz, found = recording.sample_rate_hz, []
    for each in recording.segments:
        if each.label == "realisation":
            values = recording.read(role, each.first_sample, each.last_sample + 1)
            frequency_hz, density = welch(values, rate_hz, nperseg=int(rate_hz / RESOLUTION_HZ))
            found.append(density)
    inside = (frequency_hz >= 48) & (frequency_hz <= 392)
    return frequency_hz[inside], np.mean(found, axis=0)[inside]


def notes(recording):
    return [json.loads(each.text) for each in recording.events if each.kind == "spectrum"]


def random_spectrum(seed):
    random = np.random.default_rng(seed)
    places = np.sort(random.uniform(40, 400, 4))
    return corners(*zip(places, 0.004 * 10 ** random.uniform(0, 0.8, 4), strict=True))


@pytest.mark.thorough
@pytest.mark.parametrize("spectrum", [corners((40, 0.01)), random_spectrum(3), random_spectrum(8)])
def test_the_base_reaches_the_requested_spectrum(record_noise, spectrum):
    with record_noise(noise(spectrum=spectrum)) as recording:
        frequency_hz, density = densities(recording, "base_acceleration")
        off_db = 10 * np.log10(density / density_at(spectrum, frequency_hz))
        assert np.mean(np.abs(off_db) < 3.0) > 0.95
        assert abs(np.median(off_db)) < 0.5
        last = notes(recording)[-1]
        # The rms from the spectral lines must match the rms of the samples.
        (*_, segment) = (each for each in recording.segments if each.label == "realisation")
        samples = recording.read("base_acceleration", segment.first_sample, segment.last_sample + 1)
        assert last["base_rms"] == pytest.approx(np.std(samples), rel=0.03)
        assert last["kurtosis"] == pytest.approx(np.mean(samples**4) / np.mean(samples**2) ** 2, rel=0.02)


@pytest.mark.thorough
def test_an_unknown_shaker_is_equalised(record_noise, rig):
    stiff = 2 * rig.shaker.suspension_stiffness_n_per_m
    with record_noise(noise(spectrum=corners((40, 0.005))), suspension_stiffness_n_per_m=stiff) as recording:
        first, *_ = notes(recording)
        _, density = densities(recording, "base_acceleration")
    assert first["worst_db"] < -6.0, "the model that begins is wrong"
    assert np.mean(np.abs(10 * np.log10(density / 0.005)) < 3.0) > 0.95


@pytest.mark.thorough
def test_the_base_spectrum_is_lowered_only_where_m0_would_exceed_its_limit(record_noise):
    limit = 5e-8
    with record_noise(noise(response_limits=corners((40, limit)), realisations=6)) as recording:
        _, velocity = densities(recording, "m0_velocity")
        _, density = densities(recording, "base_acceleration")
        assert np.all(10 * np.log10(velocity / limit) < 3.0)
        assert np.any(density < 0.003), "somewhere it was lowered"
        free = velocity < limit / 10
        assert np.median(10 * np.log10(density[free] / 0.01)) == pytest.approx(0.0, abs=0.6)
        assert notes(recording)[-1]["notched"] > 0


@pytest.mark.thorough
def test_a_run_with_an_unreachable_spectrum_is_ramped_down(record_noise):
    with pytest.raises(LimitExceeded, match=r"needs .* Vpp at .* allows at most amplitude_vpp = 0\.1"):
        record_noise(noise(amplitude_vpp=0.1))


def test_a_run_with_a_density_above_its_abort_limit_is_ramped_down(record_noise):
    # The first realisation already exceeds the limit of m0 by far, so that no equalisation can help.
    limits = corners((40, 1e-10))
    with pytest.raises(LimitExceeded, match=r"velocity of m0 reached .* dB above 1e-10; abort_db = 6"):
        record_noise(noise(response_limits=limits))


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"spectrum": ()}, "at least 1 item"),
        ({"spectrum": corners((100, 1), (50, 1))}, "from low to high"),
        ({"abort_db": 2.0}, "must be above tolerance_db"),
        ({"response_limits": corners((50, 1), (50, 2))}, "response_limits has corners"),
    ],
)
def test_an_inconsistent_noise_plan_is_refused(changes, said):
    with pytest.raises(ValueError, match=said):
        noise(**changes)


def test_a_spectrum_is_interpolated_logarithmically():
    spectrum = corners((10, 1.0), (100, 100.0))
    np.testing.assert_allclose(density_at(spectrum, np.array([5.0, 10**1.5, 200.0])), [1.0, 10.0, 100.0])
