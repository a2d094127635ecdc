"""Driver of the Tektronix AFG1022: it reads settings back, and turns the output off after a failed change."""

import re
import statistics
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import ClassVar, Self

import numpy as np

from ..errors import AcquisitionError, InstrumentError, InstrumentLost, LimitExceeded, SettingRefused
from ..instruments import Identity, Knob, Samples, Sweep
from ..rig import HIGH_Z, GeneratorConfig
from ._limits import AFG1022_MODEL, ArbitraryCodes, GeneratorModel, Shape
from ._scpi import SWITCH, Number, ScpiInstrument, Word, open_link

OUTPUT = Word("OUTP{c}:STAT", SWITCH)
_QUIET_FREQUENCY_HZ = 1000.0
_STOP_ATTEMPTS = 2
_LATENCY_TRIALS = 9
# The AFG1022 reports high impedance as 9.9E+37; its largest finite load is 10 kohm.
_INFINITE_OHM = 1e6
_SAME_LOAD = 0.01


class AFG1022X(ScpiInstrument):
    """An AFG1022 as a `FunctionGenerator`, over pyvisa.

    `open` returns the generator with its output off, set to a 1 kHz sine of the smallest amplitude. Frequency
    and amplitude may change during the drive. Settings beyond the model's limits or ``amplitude_limit_vpp``
    are refused (`LimitExceeded`). During a change, the amplitude exceeds neither the old nor the new setting.
    """

    model: ClassVar[GeneratorModel] = AFG1022_MODEL
    answers: ClassVar[re.Pattern[str]] = re.compile("TEKTRONIX,AFG1022", re.IGNORECASE)
    """Pattern of maker and model in the reply to ``*IDN?``; `wanted` describes the pattern in words."""
    wanted: ClassVar[str] = "TEKTRONIX,AFG1022"
    load_header: ClassVar[str] = "OUTP{c}:IMP"
    burst_channels: ClassVar[tuple[int, ...]] = (1,)

    output = OUTPUT
    shape = Word(
        "SOUR{c}:FUNC:SHAP", {Shape.SINE: ("SIN", "SINUSOID"), Shape.EDIT_MEMORY: ("EMEM", "EMEMORY")}
    )
    # The driver sends frequencies with a resolution of 1 uHz; replies have at least seven digits.
    frequency_hz = Number("SOUR{c}:FREQ", "{:.6f}", absolute=1.5e-6, relative=1e-6)
    # The panel resolves 1 mVpp. A deviation above 0.5 mVpp plus 0.1 % of the value is not a rounding error.
    panel_vpp = Number("SOUR{c}:VOLT", "{:.4f}VPP", absolute=0.6e-3, relative=1e-3)
    offset_v = Number("SOUR{c}:VOLT:OFFS", "{:.4f}", absolute=0.6e-3, relative=1e-3)
    burst_mode = Word("SOUR{c}:BURS:MODE", {"TRIG": ("TRIG", "TRIGGERED")})
    burst_cycles = Number("SOUR{c}:BURS:NCYC", "{:.0f}")
    burst = Word("SOUR{c}:BURS:STAT", SWITCH)

    identity: Identity
    """Reply to ``*IDN?``, stored completely because its last field varies."""
    codes: ArbitraryCodes | None = None
    """Waveform that the output plays from its memory; None if the output plays a sine."""
    unconfirmed: tuple[Knob, ...] = ()
    """Settings that could be neither made nor read remotely; the operator must confirm these settings."""
    _is_known = False
    _is_silent_and_closed = _has_not_stopped = False

    def __init__(self, config: GeneratorConfig) -> None:
        self._config = config
        name = f"the generator at {config.resource}"
        super().__init__(
            lambda: open_link(config.resource, config.visa_library), name, config.channel, config.settle_s
        )

    @classmethod
    def open(cls, config: GeneratorConfig) -> Self:
        """Find the generator, switch its output off, bring it into a known state, and return it.

        Raises InstrumentLost when nothing answers, InstrumentBusy when another program uses the resource,
        InstrumentError for another instrument. After an error the output is off, if it could be switched off.
        """
        generator = cls(config)
        leave = generator.disconnect  # send no more commands to an instrument of another type
        try:
            generator._identify()
            leave = generator.close
            OUTPUT.insist(generator, "OFF")
            generator.unconfirmed = generator._agree_on_load()
            generator._to_quiet_sine()
        except BaseException as error:
            try:
                leave()
            except AcquisitionError as failure:
                error.add_note(f"While cleaning up: {failure}")
            raise
        return generator

    @property
    def amplitude_range_vpp(self) -> tuple[float, float]:
        """Smallest and largest amplitude that this bench allows, peak to peak [V]."""
        return self.model.amplitude_range_vpp(self._config)

    @property
    def playing(self) -> Shape:
        """Shape of the current signal (sine or waveform); raises InstrumentError after a failed change."""
        _ = self.panel_vpp
        return Shape.SINE if self.codes is None else Shape.EDIT_MEMORY

    def load_sine(self, frequency_hz: float, amplitude_vpp: float) -> None:
        """Set up a sine. The output keeps its state: on or off."""
        self.model.check_frequency(Shape.SINE, frequency_hz)
        self.model.check_amplitude(self._config, amplitude_vpp)
        with self._changing():
            self._ensure_known()
            if self.playing is not Shape.SINE:
                self._mute()
                self._select(None)
            if amplitude_vpp < self.panel_vpp:  # noqa: PLR1730 - assigning sends a command
                self.panel_vpp = amplitude_vpp
            self.offset_v = 0.0
            self._set_frequency(frequency_hz)
            self.panel_vpp = amplitude_vpp

    def load_waveform(self, waveform: Samples, repetition_hz: float, amplitude_vpp: float) -> None:
        """Write one period to the memory, verify the memory, and select it. The output keeps its state.

        The mean of the values is removed; see `GeneratorModel.codes`. While the memory changes, the amplitude
        is at its minimum.

        Raises SettingRefused when the memory reads back differently, and LimitExceeded when points,
        repetition or amplitude are outside the limits of the instrument or the bench.
        """
        codes = self.model.codes(waveform)
        panel_vpp = amplitude_vpp * codes.panel_factor
        self.model.check_frequency(Shape.EDIT_MEMORY, repetition_hz)
        self.model.check_amplitude(self._config, panel_vpp)
        with self._changing():
            self._ensure_known()
            self._mute()
            self.offset_v = 0.0
            self._upload(codes)
            # Set the frequency before and after the shape: that of a sine may be too high for the waveform.
            self._set_frequency(repetition_hz)
            self._select(codes)
            self._set_frequency(repetition_hz)
            self.panel_vpp = panel_vpp

    def load_sweep(self, sweep: Sweep, amplitude_vpp: float) -> None:
        """Refuse the internal sweep: its duration can be set only on the panel of the generator."""
        del amplitude_vpp
        self.model.check_sweep(sweep)

    def set_frequency(self, frequency_hz: float) -> None:
        """Change the frequency during the drive, without a jump of the phase."""
        self.model.check_frequency(self.playing, frequency_hz)
        with self._changing():
            self._set_frequency(frequency_hz)

    def set_amplitude(self, amplitude_vpp: float) -> None:
        """Change the peak-to-peak amplitude during the drive."""
        _ = self.playing  # if settings are unknown, raises an error before anything is sent
        panel_vpp = amplitude_vpp * self._panel_factor
        self.model.check_amplitude(self._config, panel_vpp)
        with self._changing():
            self.panel_vpp = panel_vpp

    def arm_burst(self, cycles: int) -> None:
        """Play ``cycles`` periods at each call of `trigger`; raises LimitExceeded on channel 2."""
        if self.channel not in self.burst_channels:
            raise LimitExceeded(f"a burst was requested on channel {self.channel}; use channel 1 for bursts")
        self.model.check_burst(cycles)
        with self._changing():
            self.burst_mode = "TRIG"
            self.burst_cycles = cycles
            self.burst = "ON"

    def trigger(self) -> None:
        """Start an armed burst with a trigger."""
        with self._changing():
            self.command("*TRG")

    def end_burst(self) -> None:
        """End the burst mode, so that the signal plays continuously."""
        if self.channel in self.burst_channels:
            with self._changing():
                self.burst = "OFF"

    def start(self) -> None:
        """Turn the output on, and read the state of the output back."""
        with self._changing():
            _ = self.playing  # this raises if settings are unknown: the output then stays off
            self.output = "ON"

    def stop(self) -> None:
        """Switch the output off, at any time. If this fails, try again, if necessary in a new session.

        Raises InstrumentLost when the generator could not be reached: the output may be ON, and the operator
        must act.
        """
        if self._is_silent_and_closed:
            return
        last = ""
        # If the previous stop failed, make a single attempt, so that the run ends in a bounded time.
        for attempt in range(2 * _STOP_ATTEMPTS - 1 if self._has_not_stopped else 0, 2 * _STOP_ATTEMPTS):
            try:
                if attempt >= _STOP_ATTEMPTS:
                    self.reconnect()
                    self._forget()
                OUTPUT.insist(self, "OFF")
            except InstrumentError as failure:
                last = str(failure)
            else:
                self._has_not_stopped = False
                return
        self._has_not_stopped = True
        try:
            self._mute()
            lowered = "; its amplitude was set to the minimum"
        except InstrumentError:
            lowered = ""
        self._forget()
        raise InstrumentLost(
            f"THE OUTPUT OF {self.name} MAY STILL BE ON: it could not be switched off in "
            f"{2 * _STOP_ATTEMPTS} attempts, the last two over a new connection{lowered}. Turn the "
            "amplifier's gain down, switch the amplifier off, then check the cable and the power of the "
            f"generator ({last})"
        )

    def close(self) -> None:
        """Switch the output off and close the connection, even after an error. May be called at any time."""
        if self._is_silent_and_closed:
            return
        try:
            self.stop()
            self._is_silent_and_closed = True
        finally:
            self._forget()
            self.disconnect()

    def measured_latency_s(self) -> float:
        """Return the duration of one verified change of amplitude [s]; a stop takes at least as long.

        The result is the median of nine changes; each change sets the present amplitude again.
        """
        durations_s = []
        for _ in range(_LATENCY_TRIALS):
            began_s = time.perf_counter()
            self.set_amplitude(self.panel_vpp / self._panel_factor)
            durations_s.append(time.perf_counter() - began_s)
        return statistics.median(durations_s)

    # Operations that differ between generator models

    def _end_modes(self) -> None:
        self.end_if_known("SOUR{c}:FREQ:MODE", "CW", ("CW", "FIX", "FIXED"))
        bursts = ("BURS",) if self.channel in self.burst_channels else ()
        for node in (*bursts, "AM", "FM", "PM", "FSK", "PWM", "ASK", "PSK"):
            self.end_if_known(f"SOUR{{c}}:{node}:STAT", "OFF", SWITCH["OFF"])
        self.end_if_known("SOUR{c}:FREQ:CONC", "OFF", SWITCH["OFF"])

    def _set_frequency(self, frequency_hz: float) -> None:
        self.frequency_hz = frequency_hz

    def _select(self, codes: ArbitraryCodes | None) -> None:
        self.shape = Shape.SINE if codes is None else Shape.EDIT_MEMORY
        self.codes = codes

    def _upload(self, codes: ArbitraryCodes) -> None:
        """Write the edit memory, read it back, and compare point by point."""
        points = codes.codes.size
        self.command(f"DATA:DEF EMEM,{points}")
        self.command("DATA:DATA EMEM,", codes.codes)
        held = self.query_codes("DATA:DATA? EMEM")
        if not np.array_equal(held, codes.codes):
            compared = min(points, held.size)
            same = int(np.count_nonzero(held[:compared] == codes.codes[:compared]))
            raise SettingRefused(
                f"{self.name}: {points} points were written to its memory and {held.size} were read back; "
                f"{same} agree. Upload the waveform again; if that fails again, check the USB cable"
            )

    # Internal helpers

    @property
    def _panel_factor(self) -> float:
        """Ratio of panel amplitude to requested amplitude; not 1 for a waveform with DC or another peak."""
        return 1.0 if self.codes is None else self.codes.panel_factor

    def _mute(self) -> None:
        self.panel_vpp = self.amplitude_range_vpp[0]

    def _ensure_known(self) -> None:
        if not self._is_known:
            OUTPUT.insist(self, "OFF")
            self._to_quiet_sine()

    def _to_quiet_sine(self) -> None:
        """From any state, set a sine of the smallest amplitude, without modulation or offset."""
        # Do not use *RST, because its effect on the output is not documented for this model.
        self._end_modes()
        self.offset_v = 0.0  # set the offset first, because this lowers every peak
        self._mute()
        self._select(None)
        self._set_frequency(_QUIET_FREQUENCY_HZ)
        self._is_known = True

    def _forget(self) -> None:
        """Treat all settings as unknown, because a change was interrupted."""
        self.held.clear()
        self._is_known = False

    def _identify(self) -> None:
        self.send(f"OUTP{self.channel}:STAT OFF")
        self.send("*CLS")
        reply = self.query_patiently("*IDN?")
        fields = [field.strip() for field in reply.split(",")]
        maker, model, serial, firmware = (*fields, "", "", "", "")[:4]
        if self.answers.match(f"{maker},{model}") is None:
            raise InstrumentError(
                f"{self._config.resource} answers *IDN? with {reply!r}; {self.wanted} is needed. A command "
                "to switch its output off was sent; correct generator.resource in the configuration"
            )
        self.identity = Identity(maker, model, serial, firmware, reply)

    def _agree_on_load(self) -> tuple[Knob, ...]:
        """Set the load that the generator expects; if the load cannot be read, return a knob to confirm.

        Sources disagree on whether an AFG1022 accepts its load remotely (hardware reference 1.2), so the
        driver tries to set it. A wrong load changes the terminal voltage by a factor of two. Raises
        SettingRefused when the generator reports a different load and does not change it.
        """
        header, load = self.load_header.format(c=self.channel), self._config.load_ohm
        complaints = self.send(f"{header} {'INF' if isinstance(load, str) else f'{load:g}'}")
        reply = self.query(f"{header}?")
        self.complaints()  # discard the error: for an unknown query, the reply is empty
        wanted = load if isinstance(load, str) else f"{load:g} ohm"
        if not reply:
            return (Knob(instrument="generator", setting="output load", value=wanted),)
        held_ohm = self.query_number(f"{header}?")
        is_open = held_ohm > _INFINITE_OHM
        if is_open if isinstance(load, str) else abs(held_ohm - load) <= _SAME_LOAD * load:
            return ()
        because = f" ({'; '.join(complaints)})" if complaints else ""
        raise SettingRefused(
            f"the generator is set to a load of {HIGH_Z if is_open else f'{held_ohm:g} ohm'}, but "
            f"generator.load_ohm is {load}: every amplitude would be wrong, by a factor of two between 50 "
            f"ohm and high-Z. The output is off; set the load to {wanted} on the generator's panel, or "
            f"correct the configuration{because}"
        )

    @contextmanager
    def _changing(self) -> Iterator[None]:
        """Switch the output off when a change fails, because the state of the instrument is then unknown."""
        try:
            yield
        except InstrumentError as error:
            self._forget()
            try:
                self.stop()
            except InstrumentLost as shout:
                raise shout from error
            error.add_note("The output was switched off.")
            raise
        except KeyboardInterrupt:
            self._forget()
            raise
