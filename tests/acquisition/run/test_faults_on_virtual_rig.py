"""Faults of a laboratory on the virtual rig: a clear error, a silent generator, a kept recording.

Silence is checked in the simulated world, at the generator's terminal, not in the state of a driver.
"""

import numpy as np
import pytest

from tests.changed import changed
from vibench.acquisition import (
    InstrumentError,
    InstrumentLost,
    StopLevel,
    StopSwitch,
    open_recording,
    run_measurement,
)
from vibench.acquisition.errors import InstrumentBusy, SettingRefused
from vibench.acquisition.plan import Dwell, Measurement, RunState, SineSweep
from vibench.acquisition.recording import RecordingState
from vibench.acquisition.stopping.stop import Cause, StopRequest

from .ending_silent import bench_on, kept_drive, terminal_v, when_recording

DWELL = Measurement(
    name="run",
    excitation=Dwell(amplitude_vpp=1.5, frequency_hz=260, settle_s=0.2, duration_s=3),
    ramp_s=0.3,
    ramp_step_s=0.03,
)
SILENT_V = 5e-3
SWEEP = DWELL.model_copy(
    update={"excitation": SineSweep(amplitude_vpp=1.5, start_hz=200, stop_hz=230, duration_s=3, settle_s=0.2)}
)


def test_a_device_used_by_another_program_is_named_before_output(laboratory):
    virtual, connected = laboratory()
    with bench_on(connected):
        # The generator is released first, so that only the converter is busy.
        with pytest.raises(InstrumentError), bench_on(connected):
            pass
        virtual.faults.heal()
    virtual.faults.fail_daq("CfgSampClkTiming", -50103)
    with pytest.raises(InstrumentBusy, match="another program"):
        bench_on(connected)
    assert terminal_v(virtual) < 1e-2


def test_the_error_after_a_pulled_usb_cable_advises_switching_the_amplifier_off(laboratory, tmp_path):
    virtual, connected = laboratory()
    pull = when_recording(virtual.faults.pull_usb_cable)
    with pytest.raises(InstrumentLost, match="amplifier") as failure, bench_on(connected) as bench:
        run_measurement(bench, SWEEP, tmp_path / "run.h5", on_progress=pull)
    # A generator that cannot be reached cannot be silenced: the error says so, and the next program can.
    assert "MAY STILL BE ON" in "".join([str(failure.value), *getattr(failure.value, "__notes__", [])])
    kept_drive(tmp_path / "run.h5", RecordingState.FAILED, "InstrumentLost")
    virtual.faults.heal()
    with bench_on(connected):
        assert terminal_v(virtual) < 1e-2


def test_a_late_reply_of_the_generator_silences_the_drive(laboratory, tmp_path):
    virtual, connected = laboratory()
    delay = when_recording(lambda: virtual.faults.delay_reply(60.0))
    with bench_on(connected) as bench:
        with pytest.raises(InstrumentError, match="did not answer"):
            run_measurement(bench, SWEEP, tmp_path / "run.h5", on_progress=delay)
        assert terminal_v(virtual) < 1e-2
    kept_drive(tmp_path / "run.h5", RecordingState.FAILED, "InstrumentError")


def test_a_silently_replaced_setting_ends_the_run(laboratory, tmp_path):
    virtual, connected = laboratory()
    # The bench allows more than the instrument: 25 Vpp silently become its default.
    bold = changed(connected, generator={"amplitude_limit_vpp": 20.0})
    with bench_on(bold) as bench:
        virtual.generator.execute(b"OUTP1:IMP 50\n")
        with pytest.raises((SettingRefused, InstrumentError)) as failure:
            bench.generator.load_sine(260.0, 18.0)
        assert terminal_v(virtual) < 1e-2
    assert "18" in str(failure.value)


@pytest.mark.thorough
def test_a_laser_drop_out_and_an_overload_are_flagged_without_ending_the_run(laboratory, tmp_path):
    virtual, connected = laboratory()
    blind = when_recording(lambda: virtual.faults.over_range(0.2))
    with bench_on(connected) as bench:
        outcome = run_measurement(bench, DWELL, tmp_path / "run.h5", on_progress=blind)
        assert terminal_v(virtual) < 1e-2
    assert outcome.state is RunState.FINISHED
    with open_recording(tmp_path / "run.h5") as recording:
        assert recording.state is RecordingState.COMPLETE
        flagged = [overload for overload in recording.overloads if overload.channel == "m0_velocity"]
        samples = sum(overload.last_sample - overload.first_sample + 1 for overload in flagged)
        assert samples / recording.sample_rate_hz == pytest.approx(0.2, abs=0.05)


def test_a_drive_with_a_stuck_relay_is_silenced_by_lowering_its_amplitude(laboratory, tmp_path):
    virtual, connected = laboratory()
    switch = StopSwitch()

    def stop_with_stuck_relay(progress):
        if progress.state is RunState.RECORDING and switch.request is None:
            virtual.faults.stick_output()
            switch.ask(StopRequest(Cause.OPERATOR, StopLevel.OFF, "off pressed"))

    with bench_on(connected) as bench:
        with pytest.raises(InstrumentError, match=r"amplitude had to be lowered.*MAY STILL BE ON"):
            run_measurement(
                bench, DWELL, tmp_path / "run.h5", on_progress=stop_with_stuck_relay, switch=switch
            )
        assert terminal_v(virtual) < SILENT_V
    with open_recording(tmp_path / "run.h5") as recording:
        off, *again = [event.sample for event in recording.events if event.kind == "off"]
        assert 0 < (again[0] - off) / recording.sample_rate_hz < 1.5
        assert np.max(np.abs(recording.read("drive_voltage")[-100:])) < SILENT_V


def test_a_drive_with_a_stuck_relay_is_silenced_despite_a_keyboard_interrupt(laboratory, tmp_path):
    virtual, connected = laboratory()

    def interrupt(progress):
        if progress.state is RunState.RECORDING:
            virtual.faults.stick_output()
            switch.ask(StopRequest(Cause.OPERATOR, StopLevel.OFF, "off pressed"))
        if progress.state is RunState.RAMPING_DOWN:
            raise KeyboardInterrupt

    switch = StopSwitch()
    with bench_on(connected) as bench:
        with pytest.raises(KeyboardInterrupt):
            run_measurement(bench, DWELL, tmp_path / "run.h5", on_progress=interrupt, switch=switch)
        assert terminal_v(virtual) < SILENT_V


def test_an_output_that_stays_on_is_set_to_the_minimum_and_reported(laboratory):
    virtual, connected = laboratory()
    execute = virtual.generator.execute
    with bench_on(connected) as bench:
        bench.generator.load_sine(260.0, 1.5)
        bench.generator.start()
        virtual.generator.execute = lambda sent: execute(sent.replace(b"STAT OFF", b"STAT ON"))
        with pytest.raises(InstrumentLost, match="amplitude was set to the minimum"):
            bench.generator.stop()
        assert terminal_v(virtual) < SILENT_V
        virtual.generator.execute = execute


def test_reconnecting_a_generator_that_hangs_is_tried_once_after_a_failed_stop(laboratory, monkeypatch):
    """A run with hanging instruments must not take minutes to end."""
    virtual, connected = laboratory()
    attempts = []
    with bench_on(connected) as bench:
        virtual.faults.hang_generator()
        reconnect = bench.generator.reconnect
        monkeypatch.setattr(bench.generator, "reconnect", lambda: (attempts.append(1), reconnect()))
        for expected in (2, 3):
            with pytest.raises(InstrumentLost, match=r"MAY STILL BE ON.*switch the amplifier off"):
                bench.generator.stop()
            assert len(attempts) == expected
        virtual.faults.heal()
        bench.generator.stop()
