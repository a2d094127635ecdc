"""An accelerometer or displacement probe on m0 gives the same results as a vibrometer."""

import numpy as np
import pytest

from tests.analysis.conftest import A0_STRONG, DWELL_PART, NOISE, dwell_plan, synthetic
from vibench.acquisition import Overload, open_recording
from vibench.acquisition.plan import WhiteNoise
from vibench.analysis import Simulation, analyse_files
from vibench.analysis.errors import UnusableData
from vibench.analysis.recordings.channel_levels import channel_levels
from vibench.analysis.recordings.channels import RecordedChannels
from vibench.analysis.recordings.response import (
    ResponseChannel,
    derivative_kernel,
    integral_kernel,
    noise_as_read,
)

RATE = synthetic.RATE
ACCELERATION = ("m0_acceleration", "acceleration", "m s-2", 100.0)
DISPLACEMENT = ("m0_displacement", "displacement", "m", 1e-4)


def accelerations(velocity):
    """Differentiate by FFT; the velocity is mirrored to avoid a jump at its ends."""
    whole = np.concatenate((velocity, velocity[::-1]))
    lines = 2j * np.pi * np.fft.rfftfreq(whole.size, 1 / RATE)
    return np.fft.irfft(lines * np.fft.rfft(whole), whole.size)[: velocity.size]


def displacements(velocity):
    """Integrate by FFT without the mean velocity."""
    whole = np.concatenate((velocity, velocity[::-1]))
    lines = 2j * np.pi * np.fft.rfftfreq(whole.size, 1 / RATE)
    lines[0] = np.inf
    return np.fft.irfft(np.fft.rfft(whole) / lines, whole.size)[: velocity.size]


def analysis_of(path):
    return analyse_files([path], "response", Simulation.LEFT_OUT).results[0].analysis


@pytest.mark.parametrize("rate_hz", [5120.0, 51200.0])
@pytest.mark.parametrize("kernel", [integral_kernel, derivative_kernel])
def test_integral_and_derivative_kernels_are_exact_from_5_hz_to_0_4_of_rate(kernel, rate_hz):
    weights = kernel(rate_hz)
    turn = 2 * np.pi * np.geomspace(5.0, 0.4 * rate_hz, 60)
    lags = np.arange(weights.size) - weights.size // 2
    gain = np.exp(-1j * np.outer(turn / rate_hz, lags)) @ weights
    ideal = 1 / (1j * turn) if kernel is integral_kernel else 1j * turn
    assert np.abs(gain / ideal - 1).max() < 3e-5


SENSORS = pytest.mark.parametrize(
    ("response", "made"), [(ACCELERATION, accelerations), (DISPLACEMENT, displacements)]
)


@pytest.mark.thorough
@SENSORS
@pytest.mark.parametrize("level", ["weak", "strong"])
def test_dwell_responses_are_equal_for_any_sensor(dwell_file, dwell_motions, tmp_path, level, response, made):
    motion, velocity, _ = dwell_motions[level]
    plan = dwell_plan({"weak": 0.5e-6, "strong": A0_STRONG}[level])
    path = synthetic.write_recording(
        tmp_path, plan, motion, made(velocity), [DWELL_PART], delay_s=1 / RATE, response=response
    )
    expected = analysis_of(dwell_file(level))
    found = analysis_of(path)
    assert found.response.response_i == pytest.approx(expected.response.response_i, rel=1e-4)
    assert found.response.response_ii == pytest.approx(expected.response.response_ii, rel=1e-4)
    assert found.motion.verdict.kind is expected.motion.verdict.kind


@pytest.mark.thorough
@SENSORS
def test_noise_resonances_are_equal_for_any_sensor(noise_file, noise_motion, tmp_path, response, made):
    base, velocity, parts = noise_motion
    plan = WhiteNoise(amplitude_vpp=0.05, realisations=2, settle_s=3.0, **NOISE)
    path = synthetic.write_recording(tmp_path, plan, base, made(velocity), parts, response=response)
    expected, found = (analysis_of(each).response for each in (noise_file(), path))
    np.testing.assert_allclose(
        found.frequency_response.value, expected.frequency_response.value, rtol=1e-3, atol=1e-3
    )
    for one, other in zip(found.resonances, expected.resonances, strict=True):
        assert one.frequency_hz == pytest.approx(other.frequency_hz, rel=5e-5)


@SENSORS
def test_converted_samples_do_not_depend_on_where_reading_starts(dwell_motions, tmp_path, response, made):
    motion, velocity, _ = dwell_motions["strong"]
    path = synthetic.write_recording(
        tmp_path, dwell_plan(A0_STRONG), motion, made(velocity), [DWELL_PART], response=response
    )
    with open_recording(path) as recording:
        whole = ResponseChannel(recording).read(0, recording.samples)
        part = ResponseChannel(recording).read(10_001, 23_456)
    np.testing.assert_array_equal(part, whole[10_001:23_456])
    # The first second is excluded: the transient has components below 5 Hz.
    assert np.abs(whole - velocity)[round(RATE) : -64].max() < 2e-3 * np.abs(velocity).max()


def test_a_clipped_acceleration_marks_all_affected_samples(dwell_motions, tmp_path):
    motion, velocity, _ = dwell_motions["strong"]
    path = synthetic.write_recording(
        tmp_path,
        dwell_plan(A0_STRONG),
        motion,
        accelerations(velocity),
        [DWELL_PART],
        response=ACCELERATION,
        overloads=(Overload("m0_acceleration", 16_000, 16_002),),
    )
    with open_recording(path) as recording:
        marks = RecordedChannels(recording).overload_flags(0, recording.samples)
    assert np.flatnonzero(marks)[[0, -1]].tolist() == [16_000 - RATE, 16_002 + RATE]


def test_an_acceleration_record_of_0_5_s_is_refused(dwell_motions, tmp_path):
    motion, velocity, _ = dwell_motions["weak"]
    path = synthetic.write_recording(
        tmp_path,
        dwell_plan(0.5e-6),
        motion,
        accelerations(velocity),
        [],
        response=ACCELERATION,
        samples=round(RATE / 2),
    )
    with (
        open_recording(path) as recording,
        pytest.raises(UnusableData, match=r"0\.5 s of m0_acceleration are too short .* record more than 1 s"),
    ):
        ResponseChannel(recording)


def test_samples_near_a_gap_are_excluded(dwell_motions, tmp_path):
    motion, velocity, _ = dwell_motions["weak"]
    path = synthetic.write_recording(
        tmp_path,
        dwell_plan(0.5e-6),
        motion,
        accelerations(velocity),
        [DWELL_PART],
        response=ACCELERATION,
        hole=(16_000, 16_010),
    )
    with open_recording(path) as recording:
        lost = np.isnan(ResponseChannel(recording).read(0, recording.samples))
    assert np.flatnonzero(lost)[[0, -1]].tolist() == [16_000 - RATE, 16_009 + RATE]


def test_the_level_of_a_channel_is_computed_only_from_samples_that_were_not_lost(dwell_motions, tmp_path):
    motion, velocity, _ = dwell_motions["weak"]
    hole = (16_000, 32_000)
    path = synthetic.write_recording(tmp_path, dwell_plan(0.5e-6), motion, velocity, [DWELL_PART], hole=hole)
    with open_recording(path) as recording:
        levels = channel_levels(recording)
        rows = [recording.read(each.header.role) for each in levels]
    assert [each.rms for each in levels] == pytest.approx([np.sqrt(np.nanmean(row**2)) for row in rows])


def test_simulated_noise_of_an_accelerometer_doubles_in_power_at_the_ends():
    """Beyond an end, the integral continues with mirrored samples, which repeat the last samples' noise."""
    rng = np.random.default_rng(5)
    read = np.stack(
        [np.concatenate(list(noise_as_read("m0_acceleration", 100.0, 500, 70, rng))) for _ in range(3000)]
    )
    power = np.mean(read**2, axis=0)
    assert read.shape[1] == 500
    assert power[[0, -1]] == pytest.approx(2 * power[150:350].mean(), rel=0.1)
