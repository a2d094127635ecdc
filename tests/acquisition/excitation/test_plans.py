"""Requirements of every kind of excitation, and the signal of each kind."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from pydantic import TypeAdapter, ValidationError

from vibench.acquisition.excitation.stepped_sine import FrequencyGrid
from vibench.acquisition.instruments import Spacing
from vibench.acquisition.plan import (
    Direction,
    Dwell,
    Excitation,
    OddMultisine,
    SineSweep,
    SteppedSine,
    StreamedNoise,
    WhiteNoise,
)

PLANS = [
    WhiteNoise(amplitude_vpp=1.5, band_start_hz=20, band_stop_hz=800, realisations=3),
    OddMultisine(amplitude_vpp=1.5, band_start_hz=20, band_stop_hz=800, realisations=3),
    SineSweep(amplitude_vpp=1.5, start_hz=150, stop_hz=350, duration_s=4, settle_s=0.5),
    SineSweep(amplitude_vpp=1.5, start_hz=350, stop_hz=150, duration_s=4, spacing=Spacing.LOGARITHMIC),
    Dwell(amplitude_vpp=10.0, frequency_hz=260, duration_s=2, settle_s=1),
    SteppedSine(amplitude_vpp=1.5, frequencies_hz=(100, 150, 260), record_s=0.5, settle_s=0.25),
    SteppedSine(
        amplitude_vpp=1.5,
        grid=FrequencyGrid(start_hz=150, stop_hz=350, step_hz=50),
        direction=Direction.UP_THEN_DOWN,
    ),
    StreamedNoise(amplitude_vpp=1.5, band_start_hz=20, band_stop_hz=800, duration_s=3),
]
ANY = TypeAdapter(Excitation)
IDS = [f"{plan.kind}-{number}" for number, plan in enumerate(PLANS)]


@pytest.fixture(params=PLANS, ids=IDS)
def plan(request):
    return request.param


def test_the_step_durations_add_up_to_the_duration_of_the_plan(plan):
    assert sum(step.duration_s for step in plan.steps()) == pytest.approx(plan.playing_s, rel=1e-12)


def test_the_steps_of_a_plan_are_reproducible(plan):
    first, second = list(plan.steps()), list(plan.steps())
    assert [step.segment for step in first] == [step.segment for step in second]
    assert [(step.settle_s, step.record_s) for step in first] == [
        (step.settle_s, step.record_s) for step in second
    ]


def test_a_preview_stays_within_half_the_peak_to_peak_voltage(plan):
    shown = plan.preview(4096.0)
    assert shown.peak_v <= plan.amplitude_vpp / 2 * (1 + 1e-12)
    assert shown.peak_v == pytest.approx(np.max(np.abs(shown.volts)))
    assert len(shown.time_s) == len(shown.volts)
    assert len(shown.frequency_hz) == len(shown.spectrum_v)
    assert shown.duration_s == plan.playing_s


def test_the_preview_spectrum_has_the_rms_of_the_signal(plan):
    shown = plan.preview(4096.0)
    # Parseval: half the square of a line's peak is its contribution to the mean square.
    mean_square = np.sum(shown.spectrum_v[1:] ** 2) / 2 + shown.spectrum_v[0] ** 2
    assert np.sqrt(mean_square) == pytest.approx(shown.rms_v, rel=1e-3)


def test_the_error_for_a_preview_at_too_low_a_rate_names_the_required_rate(plan):
    with pytest.raises(ValueError, match=f"use more than {2 * plan.highest_frequency_hz:g}"):
        plan.preview(1.9 * plan.highest_frequency_hz)


@pytest.mark.parametrize("amplitude_vpp", [0.0, -1.0, 2000.0, float("nan"), float("inf")])
def test_an_amplitude_that_no_generator_can_play_is_refused(amplitude_vpp):
    with pytest.raises(ValidationError, match="amplitude_vpp"):
        Dwell(amplitude_vpp=amplitude_vpp, frequency_hz=260, duration_s=2)


def test_an_unknown_key_is_refused():
    with pytest.raises(ValidationError, match=r"amplitude_v\n.*Extra"):
        Dwell(amplitude_vpp=1.0, amplitude_v=1.0, frequency_hz=260, duration_s=2)


@pytest.mark.parametrize(
    ("kind", "fields", "sentence"),
    [
        (
            WhiteNoise,
            {"band_start_hz": 800, "band_stop_hz": 20},
            "band_stop_hz = 20 is not above band_start_hz = 800; give the band from low to high",
        ),
        (
            WhiteNoise,
            {"band_start_hz": 10, "band_stop_hz": 1000, "repetition_hz": 0.25},
            "the first image of 1000 Hz at 1048 Hz, too near the band; repetition_hz must be at least 0.3662",
        ),
        (
            WhiteNoise,
            {"band_start_hz": 20.1, "band_stop_hz": 20.9, "repetition_hz": 1},
            "no harmonic of 1 Hz is in the band up to 20.9 Hz; lower repetition_hz or widen the band",
        ),
        (SineSweep, {"start_hz": 100, "stop_hz": 100, "duration_s": 5}, "use a dwell for one frequency"),
        (
            SineSweep,
            {"start_hz": 100, "stop_hz": 200, "duration_s": 1, "step_s": 2},
            "step_s = 2 is longer than the whole sweep of 1 s; give a shorter step",
        ),
        (SteppedSine, {}, "give either frequencies_hz or grid, and not both"),
        (SteppedSine, {"frequencies_hz": (100, 90)}, "frequencies_hz has 90 after 100"),
        (
            SteppedSine,
            {"grid": {"start_hz": 1, "stop_hz": 500, "step_hz": 0.1}},
            "the plan has 4991 steps; one recording holds at most 4000",
        ),
        (
            OddMultisine,
            {"band_start_hz": 20, "band_stop_hz": 800, "excited_lines": (21, 22)},
            "contains 22, which is not an odd harmonic in the band; give odd lines from 21 to 799",
        ),
    ],
)
def test_the_error_for_a_plan_that_cannot_be_played_names_the_allowed_values(kind, fields, sentence):
    with pytest.raises(ValidationError) as refused:
        kind(amplitude_vpp=1.0, **fields)
    assert sentence in str(refused.value)


def test_periodic_noise_excites_exactly_the_spectral_lines_in_its_band():
    plan = WhiteNoise(amplitude_vpp=2.0, band_start_hz=20, band_stop_hz=800, repetition_hz=0.5)
    # At this multiple of the playback rate, lines lie on bins; images lie above half the playback rate.
    shown = plan.preview(8192 * 0.5 * 4)
    strong = shown.frequency_hz[(shown.spectrum_v > 1e-9) & (shown.frequency_hz < 2048)]
    np.testing.assert_allclose(strong, np.arange(20, 800.5, 0.5))


def test_noise_of_1_v_peak_to_peak_reaches_half_a_volt_with_a_crest_factor_of_3_to_4_5():
    shown = WhiteNoise(amplitude_vpp=1.0, band_start_hz=10, band_stop_hz=1000, realisations=1).preview(16384)
    assert shown.peak_v == pytest.approx(0.5, rel=1e-3)
    assert 0.11 < shown.rms_v < 0.17


def test_an_odd_multisine_leaves_out_one_of_every_four_odd_lines():
    plan = OddMultisine(amplitude_vpp=1.0, band_start_hz=1, band_stop_hz=800, seed=4)
    odd = np.arange(1, 800, 2).reshape(-1, 4)
    left_out = np.isin(odd, plan.detection_lines)
    assert np.all(np.sum(left_out, axis=1) == 1)
    assert sorted(plan.excited_lines + plan.detection_lines) == list(range(1, 800, 2))
    # The four places are chosen at random: all are used.
    assert set(np.argmax(left_out, axis=1)) == {0, 1, 2, 3}


def test_an_odd_multisine_is_silent_on_even_and_detection_lines():
    plan = OddMultisine(amplitude_vpp=2.0, band_start_hz=1, band_stop_hz=800)
    shown = plan.preview(8192.0)
    excited = shown.spectrum_v[list(plan.excited_lines)]
    silent = np.delete(shown.spectrum_v, list(plan.excited_lines))
    assert np.max(silent) < 1e-12 * np.mean(excited)


SWEEPS = st.builds(
    SineSweep,
    amplitude_vpp=st.just(1.0),
    start_hz=st.floats(1, 200),
    stop_hz=st.floats(201, 2000),
    duration_s=st.floats(0.5, 20),
    spacing=st.sampled_from(Spacing),
    step_s=st.floats(0.05, 0.5),
    settle_s=st.just(0.0),
)


@settings(max_examples=50)
@given(sweep=SWEEPS)
def test_a_stepped_sweep_has_the_phase_of_the_ideal_sweep_after_every_step(sweep):
    elapsed_s = cycles = 0.0
    for step in sweep.steps():
        elapsed_s += step.record_s
        cycles += step.play.frequency_hz * step.record_s
        assert cycles == pytest.approx(sweep.cycles(elapsed_s), rel=1e-9)
    assert elapsed_s == pytest.approx(sweep.duration_s, rel=1e-9)


def test_the_mean_frequency_of_a_linear_sweep_is_the_mean_of_its_first_and_last_frequency():
    sweep = SineSweep(amplitude_vpp=1, start_hz=150, stop_hz=350, duration_s=200)
    assert sweep.cycles(200.0) == pytest.approx(250.0 * 200.0, rel=1e-14)


def test_a_logarithmic_sweep_passes_the_geometric_mean_at_half_time():
    sweep = SineSweep(
        amplitude_vpp=1, start_hz=100, stop_hz=400, duration_s=10, spacing=Spacing.LOGARITHMIC, step_s=0.001
    )
    step = list(sweep.steps())[5000]
    assert step.play.frequency_hz == pytest.approx(200.0, rel=1e-3)


@pytest.mark.parametrize(("hold", "power"), [("acceleration", 0), ("velocity", 1), ("displacement", 2)])
def test_a_sweep_of_constant_motion_has_an_amplitude_that_is_a_power_of_frequency(hold, power):
    sweep = SineSweep(amplitude_vpp=1.5, start_hz=150, stop_hz=350, duration_s=20, hold=hold)
    tones = [step.play for step in sweep.steps()]
    for tone in tones:
        assert tone.level == pytest.approx((tone.frequency_hz / 350) ** power, rel=1e-12)
    shown = sweep.preview(5120.0)
    first, last = shown.volts[:5120], shown.volts[-5120:]
    ratio = (tones[9].frequency_hz / tones[-1].frequency_hz) ** power
    assert np.max(np.abs(first)) / np.max(np.abs(last)) == pytest.approx(ratio, rel=0.02)


def test_a_sweep_down_mirrors_the_sweep_up():
    up = SineSweep(amplitude_vpp=1, start_hz=150, stop_hz=350, duration_s=10)
    down = SineSweep(amplitude_vpp=1, start_hz=350, stop_hz=150, duration_s=10)
    rising = [step.play.frequency_hz for step in up.steps()]
    falling = [step.play.frequency_hz for step in down.steps()]
    np.testing.assert_allclose(rising, falling[::-1], rtol=1e-12)


def test_a_sweep_settles_only_at_its_first_step_and_all_steps_form_one_segment():
    steps = list(SineSweep(amplitude_vpp=1, start_hz=150, stop_hz=350, duration_s=10, settle_s=2).steps())
    assert steps[0].settle_s == 2
    assert {step.settle_s for step in steps[1:]} == {0.0}
    assert all(step.segment == steps[0].segment for step in steps)


def test_the_phase_is_continuous_from_one_tone_to_the_next():
    shown = SineSweep(amplitude_vpp=2, start_hz=100, stop_hz=140, duration_s=4, step_s=0.3).preview(51200)
    # A continuous sine of at most 140 Hz changes by at most this much per sample.
    assert np.max(np.abs(np.diff(shown.volts))) <= 2 * np.pi * 140 / 51200


def test_the_sweep_of_the_paper_has_an_integer_number_of_steps():
    steps = list(SineSweep(amplitude_vpp=1.5, start_hz=150, stop_hz=350, duration_s=200, step_s=0.1).steps())
    assert len(steps) == 2000


def test_a_stepped_sine_goes_up_and_then_down_through_every_frequency():
    plan = SteppedSine(
        amplitude_vpp=1,
        grid=FrequencyGrid(start_hz=100, stop_hz=100.3, step_hz=0.1),
        direction=Direction.UP_THEN_DOWN,
    )
    played = [(step.play.frequency_hz, step.segment.numbers["direction"]) for step in plan.steps()]
    rising = [100.0, 100.1, 100.2, 100.3]
    expected = [(f, "up") for f in rising] + [(f, "down") for f in rising[::-1]]
    assert [way for _, way in played] == [way for _, way in expected]
    np.testing.assert_allclose([f for f, _ in played], [f for f, _ in expected], rtol=1e-12)


class TestStreamedNoise:
    PLAN = StreamedNoise(amplitude_vpp=2.0, band_start_hz=50, band_stop_hz=800, duration_s=3, seed=9)
    RATE = 8192.0

    @settings(max_examples=30, deadline=None)
    @given(first=st.integers(0, 50_000), count=st.integers(1, 3000), cut=st.floats(0, 1))
    def test_streamed_noise_does_not_depend_on_the_block_size(self, first, count, cut):
        source = self.PLAN.source
        middle = round(cut * count)
        whole = source.samples(first, count, self.RATE)
        pieces = [
            source.samples(start, length, self.RATE)
            for start, length in ((first, middle), (first + middle, count - middle))
            if length
        ]
        np.testing.assert_allclose(np.concatenate(pieces), whole, atol=1e-13)

    def test_the_rms_of_streamed_noise_is_full_scale_divided_by_the_crest_factor(self):
        samples = self.PLAN.source.samples(0, 400_000, self.RATE)
        # 2 B T independent values: the relative standard deviation of the rms is 1 / sqrt(4 B T).
        spread = 1 / np.sqrt(4 * 750 * 400_000 / self.RATE)
        assert np.sqrt(np.mean(samples**2)) == pytest.approx(1 / 4.5, rel=5 * spread)

    def test_streamed_noise_has_almost_no_power_outside_its_band(self):
        samples = self.PLAN.source.samples(0, 2**18, self.RATE)
        power = np.abs(np.fft.rfft(samples * np.hanning(len(samples)))) ** 2
        frequency_hz = np.fft.rfftfreq(len(samples), 1 / self.RATE)
        far_out = (frequency_hz < 25) | (frequency_hz > 825)
        assert np.sum(power[far_out]) / np.sum(power) < 1e-5

    def test_the_values_of_streamed_noise_have_a_gaussian_distribution(self):
        samples = self.PLAN.source.samples(0, 400_000, self.RATE)
        assert np.mean(samples**4) / np.mean(samples**2) ** 2 == pytest.approx(3.0, abs=0.1)

    def test_streamed_noise_is_stationary_from_the_first_sample(self):
        draws = [self.PLAN.model_copy(update={"seed": seed}).source for seed in range(200)]
        starts, later = (
            np.mean([draw.samples(first, 16, self.RATE).std() for draw in draws]) for first in (0, 5000)
        )
        assert starts == pytest.approx(later, rel=0.25)
