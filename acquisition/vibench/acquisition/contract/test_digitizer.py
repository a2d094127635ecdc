"""Requirements of every converter: sample without gaps, count from zero, refuse impossible settings."""

import numpy as np

from vibench.acquisition.bench import Bench
from vibench.acquisition.contract.conftest import refusal
from vibench.acquisition.instruments import PlugInKind

KIND = PlugInKind.DIGITIZER
BLOCK = 256


def test_the_converter_reports_its_identity_channels_and_rate(bench: Bench) -> None:
    digitizer = bench.digitizer
    assert digitizer.identity.model
    assert digitizer.identity.reply
    assert digitizer.identity == digitizer.identity
    assert digitizer.roles == tuple(channel.role.value for channel in bench.rig.daq.channels)
    requested_hz = bench.rig.daq.sample_rate_hz
    assert requested_hz * (1 - 1e-6) <= digitizer.sample_rate_hz <= 2 * requested_hz


def test_blocks_begin_at_sample_zero_and_have_no_gaps(bench: Bench) -> None:
    bench.digitizer.start()
    due = 0
    for count in (1, BLOCK, 3 * BLOCK, 7):
        block = bench.digitizer.read(count)
        assert block.first_sample == due
        assert block.volts.shape == (len(bench.digitizer.roles), count)
        assert block.volts.dtype == np.float64
        assert np.all(np.isfinite(block.volts))
        due += count
    assert bench.digitizer.waiting_samples >= 0


def test_samples_are_counted_from_zero_again_after_a_stop(bench: Bench) -> None:
    bench.digitizer.stop()
    for _ in range(2):
        bench.digitizer.start()
        assert bench.digitizer.read(BLOCK).first_sample == 0
        bench.digitizer.stop()
        bench.digitizer.stop()


def test_reading_before_the_start_and_starting_twice_are_refused(bench: Bench) -> None:
    with refusal():
        bench.digitizer.read(BLOCK)
    bench.digitizer.start()
    with refusal():
        bench.digitizer.start()
    with refusal():
        bench.digitizer.read(0)


def test_volts_are_multiples_of_the_converter_step_if_it_is_known(bench: Bench) -> None:
    steps_v = bench.digitizer.volts_per_count
    assert len(steps_v) == len(bench.digitizer.roles)
    bench.digitizer.start()
    block = bench.digitizer.read(4 * BLOCK)
    if block.counts is not None:
        assert block.counts.dtype == np.int32
        np.testing.assert_array_equal(block.counts * np.array(steps_v)[:, np.newaxis], block.volts)
    for row, step_v in zip(block.volts, steps_v, strict=True):
        if step_v is not None:
            counts = row / step_v
            assert np.max(np.abs(counts - np.rint(counts))) < 1e-3


def test_reading_a_closed_converter_is_refused_and_closing_twice_is_allowed(bench: Bench) -> None:
    bench.digitizer.start()
    bench.digitizer.close()
    bench.digitizer.close()
    bench.digitizer.stop()
    with refusal():
        bench.digitizer.read(BLOCK)
