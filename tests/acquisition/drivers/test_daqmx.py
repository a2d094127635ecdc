"""The DAQmx driver through the real nidaqmx client, on the virtual rig's simulated DAQ."""

from contextlib import ExitStack
from types import SimpleNamespace

import grpc
import numpy as np
import pytest
from hypothesis import given, strategies as st
from nidaqmx.error_codes import DAQmxErrors
from nidaqmx.errors import DaqError

from tests.changed import changed
from vibench.acquisition import AcquisitionError, ConfigurationError, InstrumentError, InstrumentLost
from vibench.acquisition.drivers import DaqmxDigitizer, _daqmx
from vibench.acquisition.drivers._daqmx import linear_step_v
from vibench.acquisition.drivers._daqmx_errors import MEANINGS, from_code
from vibench.acquisition.errors import DataLost, InstrumentBusy
from vibench.acquisition.rig import load_rig
from vibench.virtual_rig import VirtualRig

RATE_HZ = 5120.0
# A missing sample in a sine of 100 Hz and 0.5 V is a step of 61 mV. Clocks that differ by some ppm
# leave 1.4 mV in half a second.
A_LOST_SAMPLE_V = 0.5 * 2 * np.pi * 100.0 / RATE_HZ


def with_daq(rig, **changes):
    return changed(rig, daq=changes)


def with_channel(rig, number, **changes):
    channels = list(rig.daq.channels)
    channels[number] = channels[number].model_copy(update=changes)
    return with_daq(rig, channels=tuple(channels))


@pytest.fixture(scope="module")
def configured():
    rig = with_daq(load_rig("virtual_rig"), sample_rate_hz=RATE_HZ)
    return changed(rig, generator={"resource": "USB0::0x0699::0x0353::DAQ1::INSTR"})


@pytest.fixture(scope="module")
def running(configured):
    with VirtualRig(configured) as virtual:
        yield virtual


@pytest.fixture
def virtual(running):
    yield running
    running.faults.heal()
    running.generator.execute(b"OUTP1 OFF")


@pytest.fixture
def rig(configured, virtual):
    return with_daq(configured, server=virtual.daq_address)


@pytest.fixture
def open_digitizer():
    """Return a function that opens digitizers; they are closed after the test."""
    with ExitStack() as closing:

        def open_one(rig):
            digitizer = DaqmxDigitizer.open(rig)
            closing.callback(digitizer.close)
            return digitizer

        yield open_one


@pytest.fixture
def digitizer(rig, open_digitizer):
    return open_digitizer(rig)


class TestReading:
    def test_the_identity_of_a_converter_names_its_product_and_driver(self, digitizer):
        assert digitizer.identity.model == "NI 9234"
        assert digitizer.identity.firmware.startswith("NI-DAQmx ")
        assert digitizer.roles == ("drive_voltage", "amplifier_voltage", "base_acceleration", "m0_velocity")

    def test_the_reported_sample_rate_is_the_rate_that_the_hardware_uses(self, rig, open_digitizer):
        digitizer = open_digitizer(with_daq(rig, sample_rate_hz=10_000))
        assert digitizer.sample_rate_hz == pytest.approx(10_240.0)

    def test_the_block_size_of_reads_does_not_change_any_sample(self, digitizer, virtual):
        virtual.generator.execute(b"SOUR1:FREQ 100;:SOUR1:VOLT 1VPP;:OUTP1 ON")
        digitizer.start()
        digitizer.read(5120)
        row = np.concatenate([digitizer.read(samples).volts[0] for samples in (7, 512, 1, 1000, 1000)])
        assert np.max(np.abs(row - sine_fit(row, 100.0))) < A_LOST_SAMPLE_V / 10

    def test_a_read_made_in_several_pieces_is_complete(self, rig, virtual, open_digitizer):
        digitizer = open_digitizer(with_daq(rig, buffer_s=0.2))
        virtual.generator.execute(b"SOUR1:FREQ 100;:SOUR1:VOLT 1VPP;:OUTP1 ON")
        digitizer.start()
        digitizer.read(5120)
        row = digitizer.read(2600).volts[0]
        assert np.max(np.abs(row - sine_fit(row, 100.0))) < A_LOST_SAMPLE_V / 10
        assert digitizer.read(1).first_sample == 7720

    def test_samples_of_a_block_are_not_overwritten_by_the_next_block(self, digitizer):
        digitizer.start()
        first = digitizer.read(100)
        kept = first.volts.copy()
        second = digitizer.read(100)
        assert not np.shares_memory(first.volts, second.volts)
        assert np.array_equal(first.volts, kept)

    def test_an_input_beyond_its_range_is_flagged_at_the_affected_samples(self, rig, virtual, open_digitizer):
        # A configured range of 1 V, while the device measures with its range of 5 V.
        digitizer = open_digitizer(with_channel(rig, 0, range_v=1.0))
        virtual.generator.execute(b"SOUR1:FREQ 100;:SOUR1:VOLT 8VPP;:OUTP1 ON")
        digitizer.start()
        digitizer.read(5120)
        block = digitizer.read(512)
        found = [overload for overload in block.overloads if overload.channel == "drive_voltage"]
        assert found
        assert all(5120 <= o.first_sample <= o.last_sample < 5632 for o in found)


class TestStates:
    def test_reading_before_the_start_and_after_the_stop_is_an_error(self, digitizer):
        with pytest.raises(InstrumentError, match=r"not sampling"):
            digitizer.read(10)
        digitizer.start()
        digitizer.stop()
        with pytest.raises(InstrumentError, match=r"not sampling"):
            digitizer.read(10)

    def test_a_closed_digitizer_cannot_be_started(self, digitizer):
        digitizer.close()
        with pytest.raises(InstrumentError, match=r"closed"):
            digitizer.start()


class TestConfiguration:
    def test_the_configured_coupling_and_sensor_current_are_set_on_the_device(self, rig, digitizer):
        # Without AC coupling the accelerometer shows its bias of volts, without current exactly nothing.
        digitizer.start()
        digitizer.read(25_600)
        seen = digitizer.read(1000).volts[2]
        assert 0.0 < np.ptp(seen) < 0.1
        assert abs(np.mean(seen)) < 0.1

    @pytest.mark.parametrize(
        ("change", "complaint"),
        [
            (lambda rig: with_daq(rig, device="Dev9"), r"no device with this name"),
            (lambda rig: with_daq(rig, product="USB-6211"), r"is a NI 9234"),
            (lambda rig: with_channel(rig, 0, physical="ai7"), r"no such channel"),
            (lambda rig: with_channel(rig, 0, range_v=50.0), r"is not supported"),
            (lambda rig: with_channel(rig, 2, iepe_current_a=0.5), r"is not supported"),
            (lambda rig: with_daq(rig, sample_rate_hz=1e6), r"is not supported"),
        ],
    )
    def test_unsupported_settings_are_reported_when_the_bench_opens(self, rig, change, complaint):
        with pytest.raises(ConfigurationError, match=complaint):
            DaqmxDigitizer.open(change(rig))
        DaqmxDigitizer.open(rig).close()  # no device stays reserved

    def test_a_missing_driver_is_reported(self, configured):
        with pytest.raises(InstrumentError, match=r"no NI-DAQmx driver.*daq\.server"):
            DaqmxDigitizer.open(configured)


class TestFaults:
    def test_a_device_reserved_by_another_task_is_reported_as_busy(self, rig, digitizer):
        with pytest.raises(InstrumentBusy, match=r"in use by another program, or by a task"):
            DaqmxDigitizer.open(rig)

    @pytest.mark.parametrize(
        ("code", "kind", "complaint"),
        [
            (-200279, DataLost, r"overwritten before they were read"),
            (-200361, DataLost, r"memory of the device overflowed"),
            (-200284, InstrumentError, r"did not come in time"),
            (-201003, InstrumentLost, r"cannot be reached"),
            (-88710, InstrumentLost, r"reset while it ran"),
            (-200088, InstrumentLost, r"no longer knows the task"),
        ],
    )
    def test_a_failed_read_is_explained_and_ends_the_run(
        self, rig, virtual, digitizer, code, kind, complaint
    ):
        digitizer.start()
        digitizer.read(100)
        virtual.faults.fail_daq("ReadAnalogF64", code)
        with pytest.raises(kind, match=complaint):
            digitizer.read(100)
        virtual.faults.heal()
        with pytest.raises(InstrumentError, match=r"not sampling"):
            digitizer.read(100)
        digitizer.stop()
        digitizer.start()
        assert digitizer.read(100).first_sample == 0

    @pytest.mark.parametrize("call", ["CreateAIVoltageChan", "CfgSampClkTiming", "TaskControl"])
    def test_a_failure_during_opening_leaves_the_device_free(self, rig, virtual, call):
        virtual.faults.fail_daq(call, -50103)
        with pytest.raises(InstrumentBusy):
            DaqmxDigitizer.open(rig)
        virtual.faults.heal()
        DaqmxDigitizer.open(rig).close()

    def test_a_dead_daq_server_is_reported_as_lost_and_closing_still_works(self, configured, open_digitizer):
        dying = configured.generator.model_copy(update={"resource": "USB0::0x0699::0x0353::DAQ2::INSTR"})
        with VirtualRig(configured.model_copy(update={"generator": dying})) as virtual:
            digitizer = open_digitizer(with_daq(configured, server=virtual.daq_address))
            digitizer.start()
            virtual.faults.lose_daq_server()
            for act in (lambda: digitizer.read(100), digitizer.stop, digitizer.close):
                with pytest.raises(InstrumentLost, match=r"device server does not answer"):
                    act()
            digitizer.close()
            digitizer.stop()


class TestErrors:
    @pytest.mark.parametrize("code", MEANINGS)
    def test_every_daqmx_error_in_the_table_states_what_failed_why_and_what_to_do(self, code):
        error = from_code(DaqError("said", code.value), "reading Dev1")
        assert isinstance(error, AcquisitionError)
        assert str(error).startswith("reading Dev1 failed: ")
        assert f"({code.name}, {code.value}: said" in str(error)
        assert "To do: " in str(error)

    def test_a_daqmx_error_outside_the_table_keeps_its_number_and_its_text(self):
        error = from_code(DaqError("Something rare", -200001), "reading Dev1")
        assert "Something rare" in str(error)
        assert "-200001" in str(error)

    def test_every_daqmx_error_of_the_hardware_reference_is_in_the_table(self):
        numbers = (
            -200279, -200361, -200010, -200714, -200284, -200278, -50103, -200022, -200077, -200220,
            -200170, -201003, -88705, -88708, -88710, -200290, -200018, -200621, -200016, -200292,
            -200560, -200983, -50405,
        )  # fmt: skip
        assert {DAQmxErrors(number) for number in numbers} <= MEANINGS.keys()


class TestScaling:
    @given(step_v=st.floats(1e-8, 1e-3))
    def test_a_linear_scaling_through_zero_has_a_converter_step(self, step_v):
        assert linear_step_v((0.0, step_v), 5.0) == step_v

    @pytest.mark.parametrize(
        "coefficients",
        [
            *((), (0.0,), (0.0, 0.0), (0.0, -1e-6), (0.0, 2e-9), (3.3e-7, 6e-7), (6e-7, 6e-7)),
            *((0.0, 6e-7, 1e-13), (0.0, 6e-7, 0.0, 1e-20)),
        ],
    )
    def test_a_shifted_or_nonlinear_scaling_has_no_converter_step(self, coefficients):
        assert linear_step_v(coefficients, 5.0) is None


def sine_fit(row, frequency_hz):
    angle = 2 * np.pi * frequency_hz * np.arange(row.size) / RATE_HZ
    basis = np.stack([np.cos(angle), np.sin(angle), np.ones_like(angle)], axis=1)
    return basis @ np.linalg.lstsq(basis, row)[0]


def test_the_call_after_an_unanswered_call_has_a_short_deadline():
    class Details(SimpleNamespace):
        def _replace(self, **changes):
            return Details(**{**vars(self), **changes})

    codes = iter(
        [grpc.StatusCode.OK, grpc.StatusCode.DEADLINE_EXCEEDED, grpc.StatusCode.OK, grpc.StatusCode.OK]
    )
    deadlines_s, client = [], _daqmx._Deadline()
    for _ in range(4):
        client.intercept_unary_unary(
            lambda details, _: (
                deadlines_s.append(details.timeout) or SimpleNamespace(code=lambda: next(codes))
            ),
            Details(metadata=None),
            None,
        )
    lost_s, usual_s = _daqmx.LOST_DEADLINE_S, _daqmx.CALL_DEADLINE_S
    assert deadlines_s == [usual_s, usual_s, lost_s, usual_s]
