"""Sweep analysis: phase from the recorded drive, separate orders, exact envelopes and responses."""

import re
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
import pytest
from scipy import signal

from tests.analysis.sine.sweep_in_memory import sweep_response
from vibench.acquisition.plan import SineSweep
from vibench.analysis import InvalidRequest, NotEnoughData
from vibench.analysis.errors import UnusableData
from vibench.analysis.recordings.channels import Stretch
from vibench.analysis.recordings.checks import Verdict
from vibench.analysis.signals import Decimator
from vibench.analysis.sine.sweep import SweepSums, drive_phase
from vibench.analysis.sine.sweep_analysis import collisions, measured_sweep, played_check
from vibench.analysis.tones import track_orders

RATE = 8192.0


def sweep(duration_s, start_hz=150.0, stop_hz=350.0, clock_ppm=0.0, rate_hz=RATE):
    """Return times [s] of the converter's clock and the sweep phase [rad] of the generator's clock."""
    time = np.arange(int(duration_s * rate_hz)) / rate_hz
    own = time * (1 + clock_ppm * 1e-6)
    return time, 2 * np.pi * (start_hz * own + 0.5 * (stop_hz - start_hz) / duration_s * own**2)


def of_unit_displacement(time, phase):
    """Return drive, base acceleration and response velocity of a displacement of 1 m."""
    speed = np.gradient(phase, time)
    return np.stack((np.cos(phase), -np.cos(phase) * speed**2, -np.sin(phase) * speed))


@dataclass
class RecordedSweep:
    """Channels of a recording that contains a sweep."""

    data: np.ndarray
    start: int
    stop: int
    sample_rate_hz: float = RATE
    response_delay_s: float = 0.0
    bridges: np.ndarray = field(default_factory=lambda: np.empty(0))

    @property
    def samples(self):
        """Number of samples per channel."""
        return self.data.shape[1]

    def response_gain(self, frequency_hz):
        """Return the gain 1 of an ideal sensor."""
        return np.ones(frequency_hz.size, dtype=complex)

    def stretches(self, label):
        """Return the range of the sweep."""
        assert label == "sweep"
        return (Stretch(self.start, self.stop, {}, is_complete=True),)

    def read(self, start, stop):
        """Return drive, base and response."""
        return self.data[:, start:stop]

    def bridge_flags(self, start, stop):
        """Return a mask of the bridged samples."""
        return np.isin(np.arange(start, stop), self.bridges)


@pytest.mark.parametrize("lost", [(), (8000,), (57_500,), (8000, 57_500)], ids=str)
def test_lost_samples_outside_a_sweep_do_not_affect_its_results(lost):
    data = of_unit_displacement(*sweep(8.0, 140, 360))
    data[:, list(lost)] = np.nan
    start, stop = round(1.0 * RATE), round(7.0 * RATE)
    plan = SineSweep(amplitude_vpp=1, start_hz=167.5, stop_hz=332.5, duration_s=6.0)
    found, _ = measured_sweep(RecordedSweep(data, start, stop), plan)
    np.testing.assert_allclose(found.peak_displacement_m, 1.0, atol=0.012)
    np.testing.assert_allclose(found.time_s, (found.frequency_hz - 167.5) / 27.5, atol=0.01)
    assert found.time_s.size == 60 if not lost else 54 < found.time_s.size < 60
    assert played_check(found, plan).verdict is Verdict.PASSED


def bridged_sweep(per_s, seed=1):
    """Return a sweep of 1 m displacement whose bridged samples have 3 times its peak velocity."""
    time, phase = sweep(8.0, 140, 360)
    speed = np.gradient(phase, time)
    data = of_unit_displacement(time, phase)
    rng = np.random.default_rng(seed)
    first = rng.integers(round(RATE), round(7 * RATE), round(6 * per_s))
    bridges = (first[:, np.newaxis] + np.arange(12)).ravel()
    data[2, bridges] = -3 * np.max(speed)
    plan = SineSweep(amplitude_vpp=1, start_hz=167.5, stop_hz=332.5, duration_s=6.0)
    return RecordedSweep(data, round(RATE), round(7 * RATE), bridges=bridges), plan, np.max(speed)


@pytest.mark.parametrize("per_s", [0.5, 2, 5])
def test_bridged_drop_outs_do_not_count_as_maxima_of_a_sweep(per_s):
    recorded, plan, fastest = bridged_sweep(per_s)
    found, _ = measured_sweep(recorded, plan)
    assert not found.is_clear.all()
    assert np.isfinite(found.response_i).mean() > 0.5
    assert found.response_i[found.largest(found.response_i)] == pytest.approx(1.0, abs=0.03)
    assert found.response_ii[found.largest(found.response_ii)] == pytest.approx(1.0, abs=0.02)
    assert np.nanmax(found.peak_displacement_m) < 1.05
    assert np.max(found.upper) < 1.01 * fastest
    assert np.max(-found.lower) < 1.01 * fastest
    assert collisions(found).regions == ()


def test_a_sweep_with_drop_outs_everywhere_is_refused():
    recorded, plan, _ = bridged_sweep(60)
    with pytest.raises(UnusableData, match="refocus the laser"):
        measured_sweep(recorded, plan)


def test_the_first_and_last_intervals_of_a_sweep_also_use_neighbouring_samples():
    """A displacement of constant amplitude is recorded for longer than the analysed sweep."""
    time, phase = sweep(6.0)
    rows = of_unit_displacement(time, phase)
    sums = SweepSums(RATE, low_hz=160, high_hz=340)
    reach = sums.neighbour_samples
    sums.add_neighbour(rows[:, :reach])
    sums.add(rows[:, reach : time.size - reach])
    sums.add_neighbour(rows[:, time.size - reach :])
    found = sums.response()
    assert found.time_s.size == (time.size - 2 * reach) // round(found.interval_s * RATE)
    np.testing.assert_allclose(found.peak_displacement_m, 1.0, atol=0.01)
    # Without the neighbouring samples, the first and last intervals are wrong.
    alone = sweep_response(*rows, RATE, low_hz=150, high_hz=350)
    assert np.max(np.abs(alone.peak_displacement_m[[0, -1]] - 1)) > 0.02


@pytest.mark.parametrize("factor", [1, 2, 5, 6])
@pytest.mark.parametrize("blocks", [[5000], [1, 2, 3000, 1997], [70, 60, 4870]])
def test_decimation_preserves_times_and_amplitudes_for_any_block_size(factor, blocks):
    time = np.arange(5000)
    x = np.cos(2 * np.pi * 0.3 / factor * time + 0.4)
    decimator = Decimator(1, factor)
    edges = np.cumsum([0, *blocks])
    parts = [decimator.add(x[np.newaxis, a:b]) for a, b in pairwise(edges)]
    y = np.concatenate([*parts, decimator.finish()], axis=1)[0]
    assert y.size == -(-5000 // factor)
    inner = slice(40, -40)
    np.testing.assert_allclose(y[inner], x[::factor][inner], atol=3e-5)


def test_decimation_removes_aliasing_components():
    decimator = Decimator(1, 4)
    x = np.cos(2 * np.pi * 0.18 * np.arange(20_000))[np.newaxis]
    y = np.concatenate((decimator.add(x), decimator.finish()), axis=1)[0]
    assert np.max(np.abs(y[50:-50])) < 3e-5


def test_the_phase_of_a_recorded_sweep_is_unaffected_by_a_clock_difference():
    rate = 2048.0
    _, recorded = sweep(200, clock_ppm=10, rate_hz=rate)
    _, nominal = sweep(200, rate_hz=rate)
    at = int(199 * rate)
    turned = np.degrees(recorded[at] - nominal[at])
    assert turned == pytest.approx(360 * 10e-6 * 199 * (150 + 199), rel=1e-3)
    assert turned == pytest.approx(250, abs=0.3)
    phase = drive_phase(np.cos(recorded), rate, low_hz=150, high_hz=350)
    error = np.abs(np.angle(np.exp(1j * (phase.phase_rad - recorded))))
    assert np.max(error[200:-200]) < np.radians(0.01)
    assert np.max(error) < np.radians(1)
    assert phase.frequency_hz[at] == pytest.approx(349 + 10e-6 * (150 + 2 * 199), abs=0.01)


def test_all_orders_are_separated_even_if_intervals_are_not_whole_numbers_of_periods():
    _, phase = sweep(20)
    parts = {0.5: 0.2 - 0.1j, 1.0: 2.0 + 1j, 1.5: 0.05j, 2.0: -0.3 + 0j, 3.0: 0.1 + 0.2j}
    x = 0.7 + sum(np.real(a * np.exp(1j * k * phase)) for k, a in parts.items())
    tracked = track_orders(x, phase, interval_samples=701)
    for order, value in parts.items():
        np.testing.assert_allclose(tracked.order(order), value, atol=1e-9)
    assert np.max(tracked.residual_rms) < 1e-9


def test_the_stated_uncertainty_of_an_order_equals_its_scatter():
    rng = np.random.default_rng(1)
    time, phase = sweep(60)
    x = np.cos(phase) + 0.3 * rng.standard_normal(time.size)
    tracked = track_orders(x, phase, interval_samples=820)
    for order in (0.5, 1.0, 3.0):
        scatter = np.std(tracked.order(order).real)
        assert np.mean(tracked.sd[tracked.orders.index(order)]) == pytest.approx(scatter, rel=0.1)
    assert np.mean(tracked.residual_rms) == pytest.approx(0.3, rel=0.02)


@pytest.mark.parametrize("direction", ["up", "down"])
def test_responses_i_and_ii_of_a_swept_linear_motion_are_equal_and_the_envelope_is_exact(direction):
    """The motion is x = 3 exp(-0.5 i) U at every frequency."""
    ends = (150.0, 350.0) if direction == "up" else (350.0, 150.0)
    time, phase = sweep(20, *ends)
    omega = np.gradient(phase) * RATE
    base = -4e-6 * omega**2 * np.sin(phase)
    velocity = 12e-6 * omega * np.cos(phase - 0.5)
    rng = np.random.default_rng(2)
    velocity += 1e-6 * rng.standard_normal(time.size)
    result = sweep_response(np.sin(phase), base, velocity, RATE, low_hz=150, high_hz=350)
    inner = slice(5, -5)
    assert np.sign(result.sweep_rate_hz_per_s) == (1 if direction == "up" else -1)
    np.testing.assert_allclose(
        result.frequency_hz, np.interp(result.time_s, time, omega) / 2 / np.pi, atol=0.2
    )
    np.testing.assert_allclose(result.drive_amplitude_m[inner], 4e-6, rtol=2e-3)
    np.testing.assert_allclose(result.response_ii[inner], 3, rtol=2e-3)
    np.testing.assert_allclose(result.response_i[inner], 3, rtol=0.02)
    np.testing.assert_allclose(result.phase_rad[inner], -0.5, atol=2e-3)
    np.testing.assert_allclose(result.upper[inner], 12e-6 * 2 * np.pi * result.frequency_hz[inner], rtol=0.02)
    np.testing.assert_allclose(result.lower[inner], -result.upper[inner], rtol=0.02)
    assert result.noise_rms == pytest.approx(np.median(result.velocity.residual_rms), rel=0.2)


def test_the_vibrometer_delay_is_removed_from_the_phase():
    time, phase = sweep(20)
    omega = np.gradient(phase) * RATE
    delay = 400e-6
    late = np.interp(time - delay, time, phase)
    rows = (np.sin(phase), -(omega**2) * np.sin(phase), omega * np.cos(late))
    result, straight = (
        sweep_response(*rows, RATE, low_hz=150, high_hz=350, delay_s=each) for each in (0.0, delay)
    )
    inner = slice(5, -5)
    assert np.all(np.abs(result.phase_rad[inner]) > 0.3)
    np.testing.assert_allclose(straight.phase_rad[inner], 0, atol=5e-3)


@pytest.mark.parametrize(
    ("quality", "shift_hz", "amplitude"), [(10, 0.02, 1.001), (50, 0.12, 1.000), (250, 0.45, 0.943)]
)
def test_a_resonance_swept_at_1_hz_per_s_shifts_as_theory_predicts(quality, shift_hz, amplitude):
    """A 260 Hz resonator is swept; the ISO 7626 limit of the sweep rate at Q = 250 is 0.97 Hz/s."""
    _, phase = sweep(40, 240.0, 280.0)
    natural = 2 * np.pi * 260
    system = signal.cont2discrete(([natural**2], [1, natural / quality, natural**2]), 1 / RATE, method="foh")
    x = signal.lfilter(np.ravel(system[0]), np.ravel(system[1]), np.sin(phase))
    tracked = track_orders(x, phase, interval_samples=410)
    frequency = 240 + (np.arange(tracked.residual_rms.size) + 0.5) * 410 / RATE
    size = np.abs(tracked.order(1.0))
    top = int(np.argmax(size[20:-20])) + 20
    near = slice(top - 6, top + 7)
    fit = np.polyfit(frequency[near] - frequency[top], size[near], 2)
    peak_hz = frequency[top] - fit[1] / (2 * fit[0])
    steady_hz = 260 * np.sqrt(1 - 1 / (2 * quality**2))
    assert peak_hz - steady_hz == pytest.approx(shift_hz, abs=0.05)
    hold = np.sinc(260 / RATE) ** 2  # gain of linear interpolation between drive samples
    steady = hold * quality / np.sqrt(1 - 1 / (4 * quality**2))
    assert size[top] / steady == pytest.approx(amplitude, abs=0.004)


def test_a_sweep_analysed_in_blocks_equals_the_whole_sweep():
    time, phase = sweep(10)
    rows = np.stack((np.sin(phase), np.sin(phase), np.cos(phase)))
    whole = sweep_response(*rows, RATE, low_hz=150, high_hz=350)
    sums = SweepSums(RATE, low_hz=150, high_hz=350)
    for first in range(0, time.size, 777):
        sums.add(rows[:, first : first + 777])
    parts = sums.response()
    np.testing.assert_allclose(parts.response_ii, whole.response_ii, rtol=1e-9)
    np.testing.assert_array_equal(parts.upper, whole.upper)


def test_an_invalid_sweep_analysis_is_refused():
    with pytest.raises(InvalidRequest, match="ascending"):
        SweepSums(RATE, low_hz=350, high_hz=150)
    with pytest.raises(InvalidRequest, match="longer intervals or fewer orders"):
        track_orders(np.zeros(1000), np.arange(1000) * 0.1, interval_samples=100)
    with pytest.raises(NotEnoughData, match="at least 10"):
        drive_phase(np.zeros(100), RATE, low_hz=150, high_hz=350)
    noise = np.random.default_rng(3).standard_normal(8192)
    with pytest.raises(UnusableData, match="no sine"):
        drive_phase(noise, RATE, low_hz=150, high_hz=350)


@pytest.mark.parametrize(
    ("played_to_hz", "verdict"), [(350.0, Verdict.PASSED), (349.5, Verdict.PASSED), (334.0, Verdict.WARNING)]
)
@pytest.mark.parametrize("is_downward", [False, True])
def test_a_sweep_whose_end_was_not_played_is_reported(played_to_hz, verdict, is_downward):
    ends = (150.0, 350.0, played_to_hz) if not is_downward else (350.0, 150.0, 500.0 - played_to_hz)
    _, phase = sweep(6.0, ends[0], ends[2])
    response = sweep_response(np.cos(phase), np.cos(phase), np.cos(phase), RATE, low_hz=150.0, high_hz=350.0)
    plan = SineSweep(amplitude_vpp=1.0, start_hz=ends[0], stop_hz=ends[1], duration_s=6.0, step_s=0.05)
    found = played_check(response, plan)
    assert found.verdict is verdict
    if verdict is Verdict.WARNING:
        assert re.search(r"at [\d.]+ Hz where [\d.]+ Hz were planned, 0\.[45]\d* s behind", found.text)


def test_a_sweep_that_differs_from_its_planned_course_is_reported():
    """A logarithmic sweep passed as linear; a sweep up and down was "8.8e+09 s ahead"."""
    plan = SineSweep(amplitude_vpp=1.0, start_hz=150.0, stop_hz=250.0, duration_s=20.0)
    time_s = np.arange(round(20 * RATE)) / RATE
    logarithmic_hz = 150.0 * (250.0 / 150.0) ** (time_s / 20.0)
    for played_hz, most_s in ((logarithmic_hz, 2.0), (250.0 - 10.0 * np.abs(time_s - 10.0), 20.0)):
        wave = np.cos(2 * np.pi * np.cumsum(played_hz) / RATE)
        response = sweep_response(wave, wave, wave, RATE, low_hz=150.0, high_hz=250.0)
        found = played_check(response, plan)
        assert found.verdict is Verdict.WARNING
        assert 1.0 < float(re.search(r"planned, (\S+) s", found.text)[1]) <= most_s
        planned = plan.model_copy(update={"spacing": "logarithmic"})
        assert (played_check(response, planned).verdict is Verdict.PASSED) == (played_hz is logarithmic_hz)
