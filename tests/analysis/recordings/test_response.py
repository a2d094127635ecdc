"""An accelerometer or displacement probe on m0 gives the same results as a vibrometer."""

import numpy as np
import pytest

from tests.analysis.conftest import A0_STRONG, A0_WEAK, DWELL_PART, dwell_plan, synthetic
from vibench.acquisition import Overload, open_recording
from vibench.analysis import analyse
from vibench.analysis.errors import UnusableData
from vibench.analysis.recordings.channels import (
    RecordedChannels,
    ResponseChannel,
    derivative_kernel,
    integral_kernel,
    noise_as_read,
)
from vibench.analysis.recordings.facts import channel_levels

RATE = synthetic.RATE
ACCELERATION = ("m0_acceleration", "acceleration", "m s-2", 100.0)
DISPLACEMENT = ("m0_displacement", "displacement", "m", 1e-4)


def derivative(velocity, order=1):
    """Differentiate by FFT; the velocity is mirrored to avoid a jump at its ends."""
    whole = np.concatenate((velocity, velocity[::-1]))
    lines = 2j * np.pi * np.fft.rfftfreq(whole.size, 1 / RATE)
    lines[0] = 0.0 if order > 0 else np.inf
    return np.fft.irfft(lines**order * np.fft.rfft(whole), whole.size)[: velocity.size]


def sensor_values(velocity, response):
    """Return the samples of a sensor on m0; a displacement has no mean."""
    return derivative(velocity, 1 if response is ACCELERATION else -1)


@pytest.fixture
def sensor_file(dwell_motions, tmp_path):
    """Return a function that writes a dwell recorded by another sensor on m0."""

    def write(level, response=ACCELERATION, parts=(DWELL_PART,), **how):
        motion, velocity, _ = dwell_motions[level]
        plan = dwell_plan({"weak": A0_WEAK, "strong": A0_STRONG}[level])
        values = sensor_values(velocity, response)
        return synthetic.write_recording(tmp_path, plan, motion, values, parts, response=response, **how)

    return write


@pytest.mark.parametrize("rate_hz", [5120.0, 51200.0])
@pytest.mark.parametrize("kernel", [integral_kernel, derivative_kernel])
def test_integral_and_derivative_kernels_are_exact_from_5_hz_to_0_4_times_the_sample_rate(kernel, rate_hz):
    weights = kernel(rate_hz)
    turn = 2 * np.pi * np.geomspace(5.0, 0.4 * rate_hz, 60)
    lags = np.arange(weights.size) - weights.size // 2
    gain = np.exp(-1j * np.outer(turn / rate_hz, lags)) @ weights
    ideal = 1 / (1j * turn) if kernel is integral_kernel else 1j * turn
    assert np.abs(gain / ideal - 1).max() < 3e-5


SENSORS = pytest.mark.parametrize("response", [ACCELERATION, DISPLACEMENT])


@pytest.mark.thorough
@SENSORS
@pytest.mark.parametrize("level", ["weak", "strong"])
def test_dwell_responses_are_equal_for_any_sensor(dwell_file, sensor_file, level, response):
    expected = analyse(dwell_file(level))
    found = analyse(sensor_file(level, response, delay_s=1 / RATE))
    assert found.response.response_i == pytest.approx(expected.response.response_i, rel=1e-4)
    assert found.response.response_ii == pytest.approx(expected.response.response_ii, rel=1e-4)
    assert found.motion.verdict.kind is expected.motion.verdict.kind


@pytest.mark.thorough
@SENSORS
def test_noise_resonances_are_equal_for_any_sensor(noise_file, noise_motion, tmp_path, response):
    plan, base, velocity, parts = noise_motion
    values = sensor_values(velocity, response)
    path = synthetic.write_recording(tmp_path, plan, base, values, parts, response=response)
    expected, found = (analyse(each).response for each in (noise_file(), path))
    np.testing.assert_allclose(
        found.frequency_response.value, expected.frequency_response.value, rtol=1e-3, atol=1e-3
    )
    for one, other in zip(found.resonances, expected.resonances, strict=True):
        assert one.frequency_hz == pytest.approx(other.frequency_hz, rel=5e-5)


@SENSORS
def test_integrated_samples_do_not_depend_on_where_reading_starts(dwell_motions, sensor_file, response):
    _, velocity, _ = dwell_motions["strong"]
    with open_recording(sensor_file("strong", response)) as recording:
        whole = ResponseChannel(recording).read(0, recording.samples)
        part = ResponseChannel(recording).read(10_001, 23_456)
    np.testing.assert_array_equal(part, whole[10_001:23_456])
    # The first second is excluded: the transient has components below 5 Hz.
    assert np.abs(whole - velocity)[round(RATE) : -64].max() < 2e-3 * np.abs(velocity).max()


def test_a_clipped_acceleration_marks_all_affected_samples(sensor_file):
    path = sensor_file("strong", overloads=(Overload("m0_acceleration", 16_000, 16_002),))
    with open_recording(path) as recording:
        marks = RecordedChannels(recording).overload_flags(0, recording.samples)
    assert np.flatnonzero(marks)[[0, -1]].tolist() == [16_000 - RATE, 16_002 + RATE]


def test_an_acceleration_record_of_0_5_s_is_refused(sensor_file):
    with (
        open_recording(sensor_file("weak", parts=(), samples=round(RATE / 2))) as recording,
        pytest.raises(UnusableData, match=r"0\.5 s of m0_acceleration are too short .* record more than 1 s"),
    ):
        ResponseChannel(recording)


def test_samples_near_a_gap_are_excluded(sensor_file):
    with open_recording(sensor_file("weak", hole=(16_000, 16_010))) as recording:
        lost = np.isnan(ResponseChannel(recording).read(0, recording.samples))
    assert np.flatnonzero(lost)[[0, -1]].tolist() == [16_000 - RATE, 16_009 + RATE]


def test_the_level_of_a_channel_is_computed_only_from_samples_that_were_not_lost(dwell_file):
    with open_recording(dwell_file("weak", hole=(16_000, 32_000))) as recording:
        levels = channel_levels(recording)
        rows = [recording.read(each.header.role) for each in levels]
    assert [each.rms for each in levels] == pytest.approx([np.sqrt(np.nanmean(row**2)) for row in rows])


@pytest.mark.thorough
def test_the_power_of_simulated_accelerometer_noise_doubles_at_the_ends_of_a_record():
    """Beyond an end, the integral continues with mirrored samples, which repeat the last samples' noise."""
    rng = np.random.default_rng(5)
    read = np.stack(
        [np.concatenate(list(noise_as_read("m0_acceleration", 100.0, 500, 70, rng))) for _ in range(3000)]
    )
    power = np.mean(read**2, axis=0)
    assert read.shape[1] == 500
    assert power[[0, -1]] == pytest.approx(2 * power[150:350].mean(), rel=0.1)
