"""A sound card as converter and output: real sounddevice, simulated PortAudio and analogue world."""

from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest

from tests.changed import changed
from vibench.acquisition import ConfigurationError, open_bench, open_recording, run_measurement
from vibench.acquisition.bench import Verdict
from vibench.acquisition.check.bench_report import bench_report
from vibench.acquisition.errors import DataLost, InstrumentLost, LimitExceeded
from vibench.acquisition.plan import Dwell, Measurement, SineSweep, StreamedNoise, WhiteNoise
from vibench.acquisition.rig import CalibrationRule, confirm_simulated
from vibench.analysis import analyse
from vibench.virtual_rig.world.world import World
from vibench_more_drivers.sound_card import _Card

from .portaudio import CARD, RATE_HZ, Silent, card_rig, simulated


@pytest.fixture(name="card_rig")
def _card_rig(rig):
    return partial(card_rig, rig)


@pytest.fixture
def audio():
    audio = simulated()
    audio.plugged = True
    yield audio
    audio.Pa_AbortStream(None)


@pytest.fixture
def card_bench(card_rig, audio):
    """Return a function that opens the bench on the card, wired to the simulated world of its rig."""
    benches = []

    def open_card_bench():
        simulated_rig = card_rig()
        world = World(simulated_rig, Silent())
        real = simulated_rig.model_copy(update={"virtual": None})
        bench = open_bench(real, confirm_simulated, CalibrationRule.WAIVED)
        card = bench.digitizer.bare().card
        audio.wire(world, lambda: card.waiting < 9600)
        benches.append(bench)
        return bench

    yield open_card_bench
    for bench in benches:
        bench.close()


@pytest.mark.thorough
def test_a_bench_with_a_sound_card_passes_its_check(card_bench, tmp_path):
    report = bench_report(card_bench(), tmp_path)
    assert [each.name for each in report.findings if each.verdict is Verdict.FAIL] == []
    assert report["drive over setting"].number == pytest.approx(1.0, abs=0.02)
    assert report["amplifier gain"].number == pytest.approx(10.0, abs=0.1)


@pytest.mark.thorough
@pytest.mark.parametrize(
    "excitation",
    [
        Dwell(amplitude_vpp=0.8, frequency_hz=160, settle_s=0.5, duration_s=2.5),
        SineSweep(amplitude_vpp=0.8, start_hz=120, stop_hz=220, duration_s=2.0, step_s=0.05, settle_s=0.5),
        StreamedNoise(amplitude_vpp=1.5, band_start_hz=40, band_stop_hz=800, duration_s=3.0, settle_s=0.5),
    ],
    ids=lambda each: each.kind,
)
def test_a_sound_card_records_the_signal_of_its_output_without_gaps(card_bench, tmp_path, excitation):
    plan = Measurement(name="card", excitation=excitation, ramp_s=0.5, ramp_step_s=0.05)
    path = run_measurement(card_bench(), plan, tmp_path / "card.h5").path
    with open_recording(path) as recording:
        assert recording.state.value == "complete"
        assert not recording.gaps
        assert recording.instruments["digitizer"].model == CARD
        if excitation.kind == "sine_sweep":
            (sweep,) = [each for each in recording.segments if each.label == "sweep"]
            drive = recording.read("drive_voltage", sweep.first_sample, sweep.last_sample + 1)
            rises = np.count_nonzero((drive[:-1] < 0) & (drive[1:] >= 0))
            assert abs(rises - 2.0 * 170) <= 2
    assert analyse(path) is not None


def test_noise_that_needs_a_generator_is_refused_before_output(card_bench, tmp_path):
    plan = Measurement(
        name="card",
        excitation=WhiteNoise(amplitude_vpp=0.5, band_start_hz=40, band_stop_hz=400),
        ramp_s=0.5,
    )
    with pytest.raises(LimitExceeded, match="range of the no function generator"):
        run_measurement(card_bench(), plan, tmp_path / "card.h5")


NUMBERS = ("input_full_scale_v", "output_full_scale_v", "low_cut_hz")


@pytest.mark.parametrize(
    ("options", "said"),
    [
        *(({name: None}, rf"daq\.options has no {name}") for name in ("calibrated", *NUMBERS)),
        *(
            ({name: wrong}, f"options.{name} = .* give a number above 0")
            for name in NUMBERS
            for wrong in ("two", True, 0.0, -1.0)
        ),
    ],
)
def test_a_sound_card_without_a_valid_calibration_is_not_opened(card_rig, audio, options, said):
    refuse(card_rig(**options), ConfigurationError, said)


def refuse(rig, kind, said):
    """Require that the bench of a rig with a card is not opened, with an error of this kind."""
    with pytest.raises(kind, match=said):
        open_bench(rig.model_copy(update={"virtual": None}), confirm_simulated, CalibrationRule.WAIVED)


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"coupling": "DC"}, "AC-coupled"),
        ({"iepe_current_a": 0.002}, "no sensor current"),
        ({"range_v": 5.0}, "reaches 2 V"),
    ],
)
def test_unsupported_sound_card_settings_are_refused(card_rig, audio, wrong, said):
    rig = card_rig()
    first, *others = rig.daq.channels
    channels = (first.model_copy(update=wrong), *others)
    refuse(changed(rig, daq={"channels": channels}), ConfigurationError, said)


def test_a_missing_sound_card_is_reported(card_rig, audio):
    audio.plugged = False
    refuse(card_rig(), InstrumentLost, "no sound card 'Simulated card'")


def test_an_input_overflow_is_reported_as_lost_data(card_bench, audio):
    bench = card_bench()
    card = bench.digitizer.bare().card
    card.most_waiting = 2000
    bench.digitizer.start()
    with card.changed:
        card.changed.wait_for(lambda: card.failure, 10.0)
    with pytest.raises(DataLost, match="overwritten before they were read"):
        bench.digitizer.read(100)


def test_an_output_underflow_of_a_sound_card_is_reported(card_bench):
    bench = card_bench()
    bench.output.write(np.zeros(600))
    bench.output.arm()
    bench.digitizer.start()
    bench.digitizer.read(4096)
    with pytest.raises(DataLost, match="ran out of samples"):
        bench.output.write(np.zeros(600))


def test_a_missing_output_of_a_card_is_reported(card_rig, audio):
    rig = card_rig()
    output = rig.daq.output.model_copy(update={"physical": "out1"})
    refuse(changed(rig, daq={"output": output}), ConfigurationError, "'out1' is not on a sound card")


def test_unread_samples_of_a_sound_card_are_kept_only_for_the_buffer_time(card_rig, audio):
    rig = card_rig()
    card = _Card(rig, (0, 1, 2, 3), 0)
    heard, fine = np.zeros((4800, 4), dtype=np.float32), SimpleNamespace(input_overflow=False)
    for _ in range(40 * round(rig.daq.buffer_s)):
        card._take_block(heard, 4800, None, fine)
    assert card.failure
    assert sum(block.shape[1] for block in card.blocks) <= (rig.daq.buffer_s + 0.2) * RATE_HZ
    card.stream.close()
