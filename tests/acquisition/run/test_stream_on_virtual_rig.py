"""Streamed noise on the virtual rig: plan, real nidaqmx, a simulated USB-4431, and the file."""

from dataclasses import dataclass

import numpy as np
import pytest

from tests.changed import changed
from vibench.acquisition import CheckFailed, open_bench, open_recording, run_measurement
from vibench.acquisition.excitation.sine_sweep import Hold
from vibench.acquisition.plan import Measurement, RunState, SineSweep, StreamedNoise
from vibench.acquisition.recording import RecordingState
from vibench.acquisition.rig import OutputUse, load_rig
from vibench.acquisition.run.silence_watch import LowLevelCheck
from vibench.virtual_rig.world.conversion import GROUP_DELAY_SAMPLES

RIG = load_rig("virtual_rig_streaming")
RATE_HZ = RIG.daq.sample_rate_hz
TERMINAL = RIG.generator.terminal_factor()
DELAY = GROUP_DELAY_SAMPLES - 0.5
"""Samples from the output to the recording: the group delay of the converter's filter, minus half a sample (a
sample is recorded at the end of its period, and the output holds it for one sample)."""
NOISE_V = RIG.virtual.converter_noise_v
PLAN = Measurement(
    name="run",
    excitation=StreamedNoise(
        amplitude_vpp=2.0, band_start_hz=50, band_stop_hz=600, settle_s=0.2, duration_s=1.0, seed=11
    ),
    ramp_s=0.3,
    ramp_step_s=0.03,
)


def rig_at_pace(pace):
    """Return the rig at a pace; in real time the output buffers two seconds for a busy computer."""
    output = RIG.daq.output.model_copy(update={"ahead_s": {"free": 0.5, "wall": 2.0}[pace]})
    return changed(RIG, virtual={"pace": pace, "speed": 1.0}, daq={"output": output})


@dataclass(frozen=True, eq=False)
class Streamed:
    """The recorded drive of the plan, with segments, state and notes."""

    drive_v: np.ndarray
    segments: dict[str, slice]
    state: RecordingState
    log: str
    output: str


@pytest.fixture(scope="module", params=["free", "wall"])
def streamed(request, tmp_path_factory):
    path = tmp_path_factory.mktemp("streamed") / "run.h5"
    with open_bench(rig_at_pace(request.param)) as bench:
        outcome = run_measurement(bench, PLAN, path)
    assert outcome.state is RunState.FINISHED
    with open_recording(path) as recording:
        return Streamed(
            recording.read("drive_voltage"),
            {each.label: slice(each.start, each.stop) for each in recording.segments},
            recording.state,
            " ".join(event.text for event in recording.events),
            recording.instruments["output"].reply,
        )


def delay(volts, samples):
    """Return the signal delayed by a fraction of a sample and held for one sample."""
    cycles = np.fft.rfftfreq(volts.size)
    shown = np.fft.rfft(volts) * np.exp(-2j * np.pi * cycles * samples) * np.sinc(cycles)
    return np.fft.irfft(shown, volts.size)


def previewed_v(streamed):
    """Return the previewed signal from the first sample of the ramp on, with its envelope [V]."""
    ramp, hold = round(PLAN.ramp_s * RATE_HZ), round(PLAN.excitation.playing_s * RATE_HZ)
    rise = 0.5 * (1 - np.cos(np.pi * np.arange(ramp) / ramp))
    envelope = np.concatenate([rise, np.ones(hold), 1 - rise])
    length = changed(PLAN, excitation={"duration_s": envelope.size / RATE_HZ})
    preview = length.excitation.preview(RATE_HZ).volts
    return TERMINAL * preview * envelope


@pytest.mark.thorough
def test_the_recording_matches_the_preview_within_converter_noise(streamed):
    expected = previewed_v(streamed)
    begin = streamed.segments["ramp_up"].start
    assert streamed.segments["ramp_down"].stop - begin == expected.size
    silence = np.zeros(1000)
    whole = np.concatenate([silence, expected, silence])
    heard = streamed.drive_v[begin - silence.size :]
    # The recording ends with the ramp; samples still in the delay of the output are missing.
    left = (heard - delay(whole, DELAY)[: heard.size])[: -GROUP_DELAY_SAMPLES - 1]
    # The remaining 5e-5 of the signal are the ripple of the converter's filter.
    assert np.sqrt(np.mean(left**2)) < 1.25 * NOISE_V
    assert np.max(np.abs(left)) < 10 * NOISE_V


@pytest.mark.thorough
def test_the_output_is_silent_between_the_check_and_the_ramp(streamed):
    quiet = streamed.drive_v[streamed.segments["check"].stop + 4000 : streamed.segments["ramp_up"].start]
    assert quiet.size > 0.2 * RATE_HZ
    assert np.std(quiet) == pytest.approx(NOISE_V, rel=0.1)


@pytest.mark.thorough
def test_the_low_level_check_plays_through_the_analogue_output(streamed):
    assert "drive 0.01993 V (0.01993 V expected)" in streamed.log
    check = streamed.drive_v[streamed.segments["check"]]
    assert np.max(np.abs(check)) == pytest.approx(0.01 * 2.0 * TERMINAL, rel=0.02)
    assert streamed.state is RecordingState.COMPLETE


def test_the_recording_names_its_analogue_output(streamed):
    assert "analogue output" in streamed.log
    assert streamed.output.startswith("Dev1/ao0 of Dev1: USB-4431")


@pytest.mark.thorough
def test_a_sweep_is_streamed_without_a_break_in_phase_or_amplitude(tmp_path):
    sweep = SineSweep(
        amplitude_vpp=1.0, start_hz=150, stop_hz=350, duration_s=1.0, step_s=0.0123, settle_s=0.2,
        hold=Hold.DISPLACEMENT,
    )  # fmt: skip
    output = RIG.daq.output.model_copy(update={"plays": OutputUse.TONES_AND_STREAMS})
    plan = PLAN.model_copy(update={"excitation": sweep})
    with open_bench(changed(RIG, daq={"output": output})) as bench:
        run_measurement(bench, plan, tmp_path / "run.h5", LowLevelCheck.RECENTLY_PASSED)
    with open_recording(tmp_path / "run.h5") as recording:
        drive = recording.read("drive_voltage")
        (swept,) = [each for each in recording.segments if each.label == "sweep"]
    # The phase is the sum of the frequencies since the ramp; every change is at the nearest sample.
    steps = list(sweep.steps())
    ends = np.cumsum([plan.ramp_s + steps[0].duration_s, *(step.record_s for step in steps[1:])])
    ends = np.round(ends * RATE_HZ).astype(int)
    counts = np.diff(ends, prepend=0)
    counts[-1] += round(plan.ramp_s * RATE_HZ)
    cycles = np.cumsum(np.repeat([step.play.frequency_hz for step in steps], counts)) / RATE_HZ
    level = np.repeat([step.play.level for step in steps], counts)
    expected = 0.5 * TERMINAL * level * np.sin(2 * np.pi * np.concatenate([[0.0], cycles[:-1]]))
    inside = slice(swept.start + 200, swept.stop - 200)
    left = drive[inside] - delay(expected, DELAY)[inside]
    assert np.sqrt(np.mean(left**2)) < 2 * NOISE_V
    assert np.max(np.abs(left)) < 1e-3


@pytest.mark.thorough
def test_the_check_through_the_analogue_output_finds_a_raised_amplifier_gain(tmp_path):
    turned = changed(RIG, amplifier={"gain_db": 20.0})
    with open_bench(turned) as bench:
        bench.rig = RIG
        with pytest.raises(CheckFailed, match="check the amplifier's gain"):
            run_measurement(bench, PLAN, tmp_path / "run.h5")
    with open_recording(tmp_path / "run.h5") as recording:
        assert recording.state is RecordingState.FAILED
        assert np.max(np.abs(recording.read("drive_voltage"))) < 0.011 * 2.0
