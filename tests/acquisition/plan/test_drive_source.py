"""Sines use the generator unless an output is configured for them; streams always use the output."""

import pytest

from vibench.acquisition.plan import (
    DriveSource,
    Dwell,
    Measurement,
    SineSweep,
    SteppedSine,
    StreamedNoise,
    WhiteNoise,
    drive_source_of,
)
from vibench.acquisition.plan._limits import limit_checks
from vibench.acquisition.rig import OutputConfig, OutputUse

STREAM = StreamedNoise(amplitude_vpp=1, band_start_hz=50, band_stop_hz=600, duration_s=1)
TONES = [
    Dwell(amplitude_vpp=1, frequency_hz=260, duration_s=1),
    SineSweep(amplitude_vpp=1, start_hz=150, stop_hz=350, duration_s=1),
    SteppedSine(amplitude_vpp=1, frequencies_hz=(100, 200), record_s=1),
]
WAVEFORM = WhiteNoise(amplitude_vpp=1, band_start_hz=20, band_stop_hz=800, realisations=1, periods=1)


def with_output(rig, plays):
    output = OutputConfig(physical="ao0", limit_v=0.3, sample_rate_hz=51200, plays=plays, source="the test")
    return rig.model_copy(update={"daq": rig.daq.model_copy(update={"output": output})})


def drive_source(excitation, rig):
    return drive_source_of(Measurement(name="m", excitation=excitation), rig)


@pytest.mark.parametrize("tone", TONES, ids=lambda tone: tone.kind)
def test_a_sine_uses_the_analogue_output_only_if_the_output_is_configured_for_sines(rig, tone):
    assert drive_source(tone, rig) is DriveSource.GENERATOR
    assert drive_source(tone, with_output(rig, OutputUse.STREAMS)) is DriveSource.GENERATOR
    assert drive_source(tone, with_output(rig, OutputUse.TONES_AND_STREAMS)) is DriveSource.OUTPUT


@pytest.mark.parametrize("plays", list(OutputUse))
def test_streams_are_played_by_the_analogue_output_and_waveforms_by_the_generator(rig, plays):
    assert drive_source(STREAM, with_output(rig, plays)) is DriveSource.OUTPUT
    assert drive_source(WAVEFORM, with_output(rig, plays)) is DriveSource.GENERATOR


def test_a_stream_is_assigned_to_an_analogue_output_even_if_the_rig_has_no_such_output(rig):
    assert drive_source(STREAM, rig) is DriveSource.OUTPUT


def test_the_limit_of_the_analogue_output_applies_only_to_signals_that_it_plays(rig):
    measurement = Measurement(name="m", excitation=TONES[0])
    named = "the analogue output's voltage (peak)"
    by_generator = limit_checks(measurement, with_output(rig, OutputUse.STREAMS))
    assert named not in [check.what for check in by_generator]
    by_output = limit_checks(measurement, with_output(rig, OutputUse.TONES_AND_STREAMS))
    (check,) = [check for check in by_output if check.what == named]
    assert not check.is_kept
    assert check.value == pytest.approx(0.5 * rig.generator.terminal_factor())
    assert check.limit == 0.3
