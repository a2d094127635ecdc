"""Synthesised samples against closed forms: envelopes, phases and segment boundaries."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

from vibench.acquisition import ConfigurationError
from vibench.acquisition.excitation.steps import GaussianBand, Stream, Tone, Waveform
from vibench.acquisition.plan import Phase, RunState
from vibench.acquisition.run.stream_drive import RELEASE_S, OutputSynthesizer

RATE_HZ = 5120.0
NOISE = Stream(GaussianBand(50.0, 600.0, seed=3))


def with_ramps(play, ramp_s=0.1, hold_s=0.3):
    return [
        Phase(RunState.RAMPING_UP, play, ramp_s),
        Phase(RunState.RECORDING, play, hold_s),
        Phase(RunState.RAMPING_DOWN, play, ramp_s),
    ]


def half_cosine(samples):
    return 0.5 * (1 - np.cos(np.pi * np.arange(samples) / samples))


def test_a_stream_is_multiplied_by_a_half_cosine_envelope():
    synthesizer = OutputSynthesizer(RATE_HZ)
    synthesizer.append(with_ramps(NOISE))
    envelope = np.concatenate([half_cosine(512), np.ones(1536), 1 - half_cosine(512), np.zeros(100)])
    expected = NOISE.source.samples(0, 2660, RATE_HZ) * envelope
    np.testing.assert_allclose(synthesizer.take(2660), expected, atol=1e-14)
    assert synthesizer.is_over


@given(cuts=st.lists(st.integers(1, 700), max_size=20))
def test_synthesised_samples_do_not_depend_on_the_block_size(cuts):
    whole, pieces = OutputSynthesizer(RATE_HZ), OutputSynthesizer(RATE_HZ)
    for synthesizer in (whole, pieces):
        synthesizer.append([*with_ramps(Tone(123.4)), *with_ramps(NOISE)])
    taken = np.concatenate([np.empty(0), *(pieces.take(count) for count in cuts)])
    np.testing.assert_allclose(taken, whole.take(taken.size), atol=1e-11)


@given(
    frequencies=st.lists(st.floats(10, 500), min_size=2, max_size=6),
    hold_s=st.floats(0.001, 0.2),
)
def test_a_tone_with_changing_frequency_is_continuous(frequencies, hold_s):
    synthesizer = OutputSynthesizer(RATE_HZ)
    tones = [Tone(each) for each in frequencies]
    synthesizer.append(
        [
            Phase(RunState.RAMPING_UP, tones[0], 0.1),
            *(Phase(RunState.RECORDING, each, hold_s) for each in tones),
            Phase(RunState.RAMPING_DOWN, tones[-1], 0.1),
        ]
    )
    volts = synthesizer.take(round(RATE_HZ * (0.25 + hold_s * len(tones))))
    # the steepest slopes of the fastest sine and of the ramp
    steepest = (2 * np.pi * max(frequencies) + np.pi / 2 / 0.1) / RATE_HZ
    assert np.max(np.abs(np.diff(volts))) <= steepest


@given(durations=st.lists(st.floats(1e-5, 0.05), min_size=1, max_size=40))
def test_segment_boundaries_are_rounded_to_the_nearest_sample(durations):
    synthesizer = OutputSynthesizer(RATE_HZ)
    levels = [1.0 if number % 2 else 0.5 for number in range(len(durations))]
    phases = [
        Phase(RunState.RECORDING, Tone(RATE_HZ / 4, level), duration)
        for level, duration in zip(levels, durations, strict=True)
    ]
    synthesizer.append([Phase(RunState.RAMPING_UP, Tone(RATE_HZ / 4, 1.0), 0.1), *phases])
    synthesizer.take(512)
    ends = np.round((0.1 + np.cumsum(durations)) * RATE_HZ).astype(int) - 512
    expected = np.repeat(levels, np.diff(ends, prepend=0))
    volts = synthesizer.take(expected.size)
    # At a quarter of the sample rate, a sine is 0, 1, 0, -1: every second sample shows its level.
    np.testing.assert_allclose(np.abs(volts[1::2]), expected[1::2], atol=1e-9)


def test_the_last_signal_of_an_output_fades_out_without_a_step():
    synthesizer = OutputSynthesizer(RATE_HZ)
    synthesizer.append(
        [Phase(RunState.CHECKING, Tone(160.0), 0.2), Phase(RunState.CHECKING, Tone(160.0), 0.3)]
    )
    volts = synthesizer.take(round(RATE_HZ))
    release = round(RELEASE_S * RATE_HZ)
    expected = np.sin(2 * np.pi * 160.0 * np.arange(2560, 2560 + release) / RATE_HZ)
    np.testing.assert_allclose(volts[2560 : 2560 + release], expected * (1 - half_cosine(release)), atol=1e-9)
    assert not np.any(volts[2560 + release :])
    assert synthesizer.is_over


def test_a_signal_appended_after_the_end_begins_at_the_next_sample():
    synthesizer = OutputSynthesizer(RATE_HZ)
    synthesizer.append(with_ramps(NOISE))
    synthesizer.take(4321)
    synthesizer.append(with_ramps(Tone(100.0)))
    expected = np.sin(2 * np.pi * 100.0 * np.arange(512) / RATE_HZ) * half_cosine(512)
    np.testing.assert_allclose(synthesizer.take(512), expected, atol=1e-12)


@pytest.mark.parametrize("taken", [0, 1, 300, 1000, 2300, 2600])
def test_a_fade_out_starts_at_the_current_level_and_ends_in_silence(taken):
    synthesizer = OutputSynthesizer(RATE_HZ)
    synthesizer.append(with_ramps(NOISE))
    synthesizer.take(taken)
    level = synthesizer.level
    synthesizer.fade(0.1)
    faded = synthesizer.take(600)
    expected = NOISE.source.samples(taken, 512, RATE_HZ) * level * (1 - half_cosine(512))
    np.testing.assert_allclose(faded[:512], expected, atol=1e-12)
    assert not np.any(faded[512:])
    assert synthesizer.level == 0.0


def test_the_synthesizer_refuses_generator_waveforms():
    synthesizer = OutputSynthesizer(RATE_HZ)
    synthesizer.append(with_ramps(Waveform(np.array([0.0, 1.0]), 1.0)))
    with pytest.raises(ConfigurationError, match="use the function generator"):
        synthesizer.take(10)
