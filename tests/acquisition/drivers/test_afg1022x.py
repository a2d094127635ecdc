"""The AFG1022 driver through the real pyvisa, on a simulated AFG1022 on a USB bus in memory."""

import errno
import math
from dataclasses import replace

import numpy as np
import pytest

from vibench.acquisition import InstrumentError, InstrumentLost, LimitExceeded
from vibench.acquisition.drivers import AFG1022X
from vibench.acquisition.drivers._limits import Shape
from vibench.acquisition.errors import InstrumentBusy, SettingRefused
from vibench.acquisition.instruments import Knob
from vibench.virtual_rig.generator.channel_output import OPEN_AMPLITUDE_RANGE_VPP, RunMode
from vibench.virtual_rig.generator.scpi_instrument import Quirks, ScpiSocket

SINE = np.sin(2 * np.pi * np.arange(1024) / 1024)


@pytest.fixture
def generator(plugged):
    opened = AFG1022X.open(plugged.config)
    plugged.log.forget()
    yield opened
    plugged.usb.mend(errno.ENODEV)
    opened.close()


@pytest.fixture
def playing(generator):
    generator.load_sine(260.0, 0.1)
    generator.start()
    return generator


def largest_peak_v(states):
    return max(abs(state.offset_v) + state.amplitude_vpp / 2 for state in states)


class TestOpening:
    def test_the_output_is_switched_off_first_and_an_empty_identity_is_queried_again(self, plugged):
        generator = AFG1022X.open(plugged.config)
        assert plugged.log.messages[0] == "OUTP1:STAT OFF"
        assert plugged.log.messages.count("*IDN?") == 2
        assert generator.identity.model == "AFG1022"
        assert generator.identity.serial == plugged.instrument.serial
        assert generator.identity.reply.startswith("TEKTRONIX,AFG1022,")
        generator.close()

    def test_opening_resets_the_generator_to_a_quiet_sine(self, plugged):
        for message in (b"SOUR1:VOLT 3VPP", b"SOUR1:VOLT:OFFS 0.5", b"SOUR1:FUNC RAMP", b"OUTP1 ON"):
            plugged.instrument.execute(message)
        plugged.instrument.configure(1, replace(plugged.instrument.settings(1), mode=RunMode.AM))
        generator = AFG1022X.open(plugged.config)
        state = plugged.instrument.settings(1)
        assert not plugged.is_on
        assert (state.shape, state.mode.value, state.offset_v) == ("SIN", "CW", 0.0)
        assert state.amplitude_vpp == pytest.approx(OPEN_AMPLITUDE_RANGE_VPP[0])
        generator.close()

    def test_old_errors_in_the_queue_do_not_prevent_opening(self, plugged):
        plugged.instrument.execute(b"NONSENSE")
        AFG1022X.open(plugged.config).close()

    def test_an_instrument_missing_from_the_bus_is_reported_as_lost(self, bus):
        config = bus.plug_in().config.model_copy(update={"resource": "USB0::0x0699::0x0353::NOBODY::INSTR"})
        with pytest.raises(InstrumentLost, match=r"NOBODY.*power and cable"):
            AFG1022X.open(config)

    def test_an_unknown_instrument_is_named_and_receives_no_settings(self, impostor):
        with pytest.raises(InstrumentError, match=r"AFG1062.*TEKTRONIX,AFG1022 is needed"):
            AFG1022X.open(impostor.config)
        assert impostor.log.commands() == ["OUTP1:STAT OFF", "*CLS"]

    def test_a_generator_in_use_is_refused_with_its_serial_number(self, plugged, generator):
        with pytest.raises((InstrumentBusy, InstrumentLost), match=plugged.instrument.serial):
            AFG1022X.open(plugged.config)
        generator.load_sine(100.0, 1.0)


class TestLoad:
    def test_a_high_impedance_load_is_set_and_the_ohm_sign_in_the_reply_is_read(self, plugged, generator):
        assert math.isinf(plugged.instrument.settings(1).declared_load_ohm)
        assert generator.unconfirmed == ()

    def test_an_unreadable_load_must_be_confirmed_by_the_operator(self, bus):
        plugged = bus.plug_in(Quirks(panel_load_ohm=math.inf))
        generator = AFG1022X.open(plugged.config)
        assert generator.unconfirmed == (Knob(instrument="generator", setting="output load", value="high-z"),)
        generator.close()

    def test_a_wrong_load_set_on_the_panel_is_refused_with_advice(self, panel_load):
        with pytest.raises(
            SettingRefused, match=r"set to a load of 50 ohm.*factor of two.*high-z on the generator's panel"
        ):
            AFG1022X.open(panel_load.config)
        assert not panel_load.is_on

    def test_a_correct_load_set_on_the_panel_needs_no_confirmation(self, panel_load):
        generator = AFG1022X.open(panel_load.config.model_copy(update={"load_ohm": 50.0}))
        assert generator.unconfirmed == ()
        generator.close()

    def test_a_declared_load_of_50_ohm_halves_the_amplitude_range(self, bus):
        config = bus.plug_in().config.model_copy(update={"load_ohm": 50.0, "amplitude_limit_vpp": 20.0})
        generator = AFG1022X.open(config)
        assert generator.amplitude_range_vpp == (1e-3, 10.0)
        generator.close()


class TestPlaying:
    def test_the_commands_sent_to_the_generator_follow_its_manual(self, plugged, generator):
        generator.load_sine(260.0, 1.5)
        generator.start()
        assert plugged.log.commands() == [
            "SOUR1:VOLT:OFFS 0.0000",
            "SOUR1:FREQ 260.000000",
            "SOUR1:VOLT 1.5000VPP",
            "OUTP1:STAT ON",
        ]

    def test_every_setting_is_read_back_and_the_error_queue_is_emptied(self, plugged, generator):
        generator.set_frequency(261.0)
        assert plugged.log.messages == ["SOUR1:FREQ 261.000000", "SYST:ERR?", "SOUR1:FREQ?"]

    @pytest.mark.parametrize("points", [2, 3, 1024, 8191, 8192])
    def test_the_waveform_memory_holds_the_requested_values(self, plugged, generator, points):
        values = np.cos(2 * np.pi * np.arange(points) / points)
        generator.load_waveform(values, 2.0, 0.5)
        held = plugged.instrument.memory.codes("EMEM")
        assert generator.playing is Shape.EDIT_MEMORY
        assert held.tolist() == generator.codes.codes.tolist()
        volts = (held / 8191.5 - 1) * generator.panel_vpp / 2
        assert np.max(np.abs(volts - 0.25 * (values - values.mean()))) < 0.5 / 16383 + 0.5e-4

    @pytest.mark.thorough
    def test_a_waveform_with_newline_bytes_is_transferred_intact_through_a_socket(self, plugged):
        with ScpiSocket(plugged.instrument) as socket:
            config = plugged.config.model_copy(update={"resource": socket.resource_name})
            generator = AFG1022X.open(config)
            generator.load_waveform(np.linspace(-1, 1, 8192), 2.0, 0.5)
            held = plugged.instrument.memory.codes("EMEM")
            assert b"\n" in held.tobytes()
            assert held.tolist() == generator.codes.codes.tolist()
            with pytest.raises(InstrumentError, match="more than 300 bytes"):
                generator.query("DATA:DATA? EMEM")
            assert generator.query("OUTP1?") == "0"
            generator.close()

    def test_an_asymmetric_waveform_has_the_right_voltage_after_an_amplitude_change(self, plugged, generator):
        values = np.array([1.0, -0.2, -0.2, -0.2, -0.2])
        generator.load_waveform(values, 2.0, 1.0)
        generator.set_amplitude(2.0)
        held = plugged.instrument.memory.codes("EMEM")
        volts = (held / 8191.5 - 1) * plugged.instrument.settings(1).amplitude_vpp / 2
        assert volts == pytest.approx(values - values.mean(), abs=2 / 16383)

    def test_the_output_has_no_overshoot_when_the_signal_is_changed(self, plugged, generator):
        generator.load_sine(20e6, 2.0)
        generator.start()
        for change in (
            lambda: generator.load_waveform(SINE, 1.0, 1.0),
            lambda: generator.load_waveform(-SINE, 5.0, 0.2),
            lambda: generator.load_sine(20e6, 2.0),
            lambda: generator.load_sine(10.0, 0.1),
            lambda: generator.load_sine(300.0, 3.0),
        ):
            before = plugged.instrument.settings(1)
            plugged.log.forget()
            change()
            allowed = largest_peak_v([before, plugged.instrument.settings(1)])
            assert largest_peak_v(plugged.log.states) <= allowed + 1e-9
            assert plugged.is_on

    def test_the_waveform_memory_is_changed_only_at_the_lowest_amplitude(self, plugged, generator):
        generator.load_waveform(SINE, 1.0, 3.0)
        generator.start()
        plugged.log.forget()
        generator.load_waveform(SINE[::-1], 1.0, 3.0)
        told = zip(plugged.log.messages, plugged.log.states, strict=True)
        heard = [
            state.amplitude_vpp for message, state in told if message.startswith(("DATA:", "SOUR1:FUNC"))
        ]
        assert max(heard) == pytest.approx(OPEN_AMPLITUDE_RANGE_VPP[0])

    def test_a_burst_is_set_to_the_requested_number_of_cycles_and_can_be_ended(self, plugged, generator):
        generator.load_sine(100.0, 1.0)
        generator.arm_burst(7)
        state = plugged.instrument.settings(1)
        assert (state.mode.value, state.burst_cycles, state.burst_mode.value) == ("BURS", 7, "TRIGgered")
        generator.trigger()
        generator.end_burst()
        assert plugged.instrument.settings(1).mode.value == "CW"

    def test_the_second_channel_plays_sines_and_refuses_bursts(self, plugged):
        config = plugged.config.model_copy(update={"channel": 2})
        generator = AFG1022X.open(config)
        generator.load_sine(123.0, 0.5)
        assert plugged.instrument.settings(2).frequency_hz == 123.0
        with pytest.raises(LimitExceeded, match=r"channel 2"):
            generator.arm_burst(3)
        generator.close()

    def test_the_latency_of_a_verified_amplitude_command_is_measured(self, plugged, generator):
        generator.load_sine(100.0, 0.1)
        plugged.log.forget()
        assert 0 < generator.measured_latency_s() < 1.0
        assert plugged.log.commands().count("SOUR1:VOLT 0.1000VPP") == 9


class TestLimits:
    @pytest.mark.parametrize(
        ("act", "complaint"),
        [
            (lambda g: g.load_sine(25.1e6, 1.0), r"2.51e\+07 Hz"),
            (lambda g: g.load_sine(math.nan, 1.0), "nan Hz"),
            (lambda g: g.load_sine(100.0, 10.1), "amplitude_limit_vpp = 10"),
            (lambda g: g.load_sine(100.0, math.nan), "nan Vpp"),
            (lambda g: g.load_sine(100.0, 0.001), "0.002 to 10 Vpp"),
            (lambda g: g.load_waveform(SINE, 10.1e6, 1.0), "EMEM"),
            (lambda g: g.set_amplitude(10.5), "10.5 Vpp"),
            (lambda g: g.set_frequency(0.0), "0 Hz"),
            (lambda g: g.arm_burst(0), "0 cycles"),
        ],
    )
    def test_invalid_settings_are_refused_before_sending(self, plugged, generator, act, complaint):
        generator.load_sine(100.0, 1.0)
        plugged.log.forget()
        with pytest.raises(LimitExceeded, match=complaint):
            act(generator)
        assert plugged.log.messages == []

    def test_the_configured_amplitude_limit_overrides_the_limit_of_the_instrument(self, plugged):
        generator = AFG1022X.open(plugged.config.model_copy(update={"amplitude_limit_vpp": 0.5}))
        generator.load_sine(100.0, 0.5)
        with pytest.raises(LimitExceeded, match=r"amplitude_limit_vpp = 0.5"):
            generator.set_amplitude(0.51)
        generator.close()


class TestFaults:
    def test_the_output_is_silenced_with_an_error_if_an_instrument_replaces_a_setting(self, plugged, playing):
        # At a load of 10 ohm, set at the panel, 10 Vpp is out of range and silently becomes 1 Vpp.
        plugged.instrument.execute(b"OUTP1:IMP 10")
        with pytest.raises(SettingRefused, match=r"10\.0000VPP, but '1.* was read back") as caught:
            playing.set_amplitude(10.0)
        assert not plugged.is_on
        assert "The output was switched off." in caught.value.__notes__

    def test_an_error_of_the_instrument_is_raised_and_silences_the_output(self, bus):
        plugged = bus.plug_in(Quirks(out_of_range_becomes_default=False))
        generator = AFG1022X.open(plugged.config)
        generator.load_sine(260.0, 0.1)
        generator.start()
        plugged.instrument.execute(b"OUTP1:IMP 1")
        with pytest.raises(InstrumentError, match=r"refused.*-222"):
            generator.set_amplitude(9.0)
        assert not plugged.is_on
        generator.close()

    def test_a_waveform_that_reads_back_differently_is_refused(self, plugged, generator):
        def spoil(message):
            if message.startswith(b"DATA:DATA EMEM"):
                spoilt = plugged.instrument.memory.codes("EMEM").copy()
                spoilt[4] = 0
                plugged.instrument.memory.store("EMEM", spoilt)

        plugged.log.after = spoil
        with pytest.raises(SettingRefused, match=r"1024 points were written to its memory.*1023 agree"):
            generator.load_waveform(SINE, 1.0, 0.1)

    @pytest.mark.parametrize(
        ("spoil", "said"),
        [
            (lambda instrument: instrument.corrupt_next_reply(), r"answered SYST:ERR\?"),
            (lambda instrument: instrument.delay_next_reply(10.0), "did not answer"),
        ],
    )
    def test_a_corrupt_or_late_answer_silences_the_output_with_an_error(self, plugged, playing, spoil, said):
        spoil(plugged.instrument)
        with pytest.raises(InstrumentError, match=said):
            playing.set_frequency(261.0)
        assert not plugged.is_on

    def test_after_a_fault_the_next_sine_starts_from_a_known_state(self, plugged, generator):
        generator.load_sine(260.0, 0.1)
        plugged.instrument.corrupt_next_reply()
        with pytest.raises(InstrumentError):
            generator.set_frequency(261.0)
        with pytest.raises(InstrumentError, match=r"settings are unknown"):
            generator.start()
        generator.load_sine(262.0, 0.1)
        generator.start()
        assert plugged.is_on
        assert plugged.instrument.settings(1).frequency_hz == 262.0

    @pytest.mark.parametrize("act", [lambda generator: generator.set_amplitude(0.2), AFG1022X.close])
    def test_a_lost_generator_is_reported_with_advice_and_can_be_stopped_later(self, plugged, playing, act):
        plugged.usb.fail(errno.ENODEV)
        with pytest.raises(InstrumentLost, match=r"MAY STILL BE ON.*Turn the amplifier"):
            act(playing)
        assert plugged.is_on
        plugged.usb.mend(errno.ENODEV)
        playing.stop()
        assert not plugged.is_on

    def test_an_interrupted_opening_leaves_the_output_off_and_the_instrument_free(self, plugged):
        plugged.instrument.execute(b"OUTP1 ON")
        interrupted = []

        def interrupt(message):
            if message.startswith(b"SOUR1:FUNC:SHAP SIN") and not interrupted:
                interrupted.append(message)
                raise KeyboardInterrupt

        plugged.log.before = interrupt
        with pytest.raises(KeyboardInterrupt):
            AFG1022X.open(plugged.config)
        assert not plugged.is_on
        AFG1022X.open(plugged.config).close()
