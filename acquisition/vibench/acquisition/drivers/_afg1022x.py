"""The Tektronix AFG1022: every setting read back, and an output that goes off whatever happens."""

import re
import statistics
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import ClassVar, Self

from ..errors import AcquisitionError, InstrumentError, InstrumentLost
from ..instruments import Identity, Knob, Samples, Sweep
from ..rig import GeneratorConfig
from ._afg1022_channel import Afg1022Channel, Playing
from ._afg1022_modes import trigger
from ._arbitrary_codes import arbitrary_codes
from ._generator_limits import AFG1022_MODEL, GeneratorModel, Shape
from ._scpi import ScpiPort
from ._verified_settings import VerifiedSettings
from ._visa_link import Link, open_link


@contextmanager
def noted(error: BaseException) -> Iterator[None]:
    """Clean up after ``error``: a further failure of an instrument is added to it as a note."""
    try:
        yield
    except AcquisitionError as failure:
        error.add_note(f"While cleaning up: {failure}")


_STOP_ATTEMPTS = 2
_LATENCY_TRIALS = 9


class AFG1022X:
    """An AFG1022 as a `FunctionGenerator`, over pyvisa.

    Made by `open`, with the output off, 1 kHz sine at the smallest amplitude, no offset. Frequency
    and amplitude may change while it plays. Nothing is sent that its limits or the bench's
    ``amplitude_limit_vpp`` forbid (`LimitExceeded`), and no step between two settings is larger than
    the larger of them.
    """

    model: ClassVar[GeneratorModel] = AFG1022_MODEL
    wanted: ClassVar[str] = "TEKTRONIX,AFG1022"
    """Maker and model that ``*IDN?`` must answer, for people."""
    answers: ClassVar[re.Pattern[str]] = re.compile("TEKTRONIX,AFG1022", re.IGNORECASE)
    """And as they are compared."""

    def __init__(self, config: GeneratorConfig, connect: Callable[[], Link]) -> None:
        self._config = config
        self._connect = connect
        self._port = self._new_port()
        self._channel = self._new_channel()
        self._identity: Identity | None = None
        self._unconfirmed: tuple[Knob, ...] = ()
        self._is_silent_and_closed = False

    @classmethod
    def open(cls, config: GeneratorConfig) -> Self:
        """Find the generator, switch its output off, and bring it into a known state.

        Raises
        ------
        InstrumentLost, InstrumentBusy, InstrumentError
            When nothing, another program, or another instrument answers; the output is then off,
            as far as the instrument could be reached.

        """
        generator = cls(config, lambda: open_link(config.resource, config.visa_library))
        try:
            generator._identify()
        except BaseException as error:
            with noted(error):
                generator._port.close()  # another instrument is not ours to command any further
            raise
        try:
            generator._bring_up()
        except BaseException as error:
            with noted(error):
                generator.close()
            raise
        return generator

    @property
    def identity(self) -> Identity:
        """Who answered ``*IDN?``; the reply is kept whole, since its last field varies."""
        if self._identity is None:
            raise InstrumentError(f"{self._name} has not been identified yet; make it with AFG1022X.open")
        return self._identity

    @property
    def unconfirmed(self) -> tuple[Knob, ...]:
        """Settings that could be neither made nor read remotely: the operator must confirm them."""
        return self._unconfirmed

    @property
    def playing(self) -> Playing:
        """What the instrument holds, as read back."""
        return self._channel.playing

    @property
    def amplitude_range_vpp(self) -> tuple[float, float]:
        """Smallest and largest amplitude that may be set here, peak to peak [V]."""
        return self.model.amplitude_range_vpp(self._config)

    def load_sine(self, frequency_hz: float, amplitude_vpp: float) -> None:
        """Set up a sine. The output keeps its state."""
        self.model.check_frequency(Shape.SINE, frequency_hz)
        self.model.check_amplitude(self._config, amplitude_vpp, 0.0)
        with self._changing():
            self._ensure_known()
            if self.playing.shape is not Shape.SINE:
                self._channel.mute()
                self._channel.select_sine()
            if amplitude_vpp < self.playing.panel_vpp:
                self._channel.set_panel(amplitude_vpp)
            self._channel.set_offset(0.0)
            self._channel.set_frequency(frequency_hz)
            self._channel.set_panel(amplitude_vpp)

    def load_waveform(self, waveform: Samples, repetition_hz: float, amplitude_vpp: float) -> None:
        """Put one period in memory, compare the memory with it, and select it. The output keeps its state.

        The mean is taken out, see `arbitrary_codes`. While the memory changes, the amplitude is at
        its minimum.

        Raises
        ------
        SettingRefused
            When the memory reads back differently.
        LimitExceeded
            When points, repetition or amplitude are outside what instrument or bench allow.

        """
        codes = arbitrary_codes(waveform, self.model)
        panel_vpp = amplitude_vpp * codes.panel_factor
        self.model.check_frequency(Shape.EDIT_MEMORY, repetition_hz)
        self.model.check_amplitude(self._config, panel_vpp, 0.0)
        with self._changing():
            self._ensure_known()
            self._channel.mute()
            self._channel.set_offset(0.0)
            self._channel.upload(codes)
            # Before the shape as well: a sine's frequency may be too high for the memory.
            self._channel.set_frequency(repetition_hz)
            self._channel.select_memory(codes)
            self._channel.set_frequency(repetition_hz)
            self._channel.set_panel(panel_vpp)

    def load_sweep(self, sweep: Sweep, amplitude_vpp: float) -> None:
        """Refuse: its sweep time is set on the panel only."""
        del amplitude_vpp
        self.model.check_sweep(sweep)

    def set_frequency(self, frequency_hz: float) -> None:
        """Change the frequency of what is playing; the phase goes on without a jump."""
        self.model.check_frequency(self.playing.shape, frequency_hz)
        with self._changing():
            self._channel.set_frequency(frequency_hz)

    def set_amplitude(self, amplitude_vpp: float) -> None:
        """Change the peak-to-peak amplitude of what is playing."""
        playing = self.playing
        panel_vpp = amplitude_vpp * playing.panel_factor
        self.model.check_amplitude(self._config, panel_vpp, playing.offset_v)
        with self._changing():
            self._channel.set_panel(panel_vpp)

    def arm_burst(self, cycles: int) -> None:
        """Play ``cycles`` periods at each `trigger` instead of playing on."""
        with self._changing():
            self._channel.arm_burst(cycles)

    def trigger(self) -> None:
        """Fire an armed burst."""
        with self._changing():
            trigger(self._channel.settings)

    def end_burst(self) -> None:
        """Play on without a trigger."""
        with self._changing():
            self._channel.end_burst()

    def start(self) -> None:
        """Turn the output on, and see that it is."""
        with self._changing():
            self._channel.output_on()

    def stop(self) -> None:
        """Turn the output off. Legal at any time; tries again, over a new session too.

        Raises
        ------
        InstrumentLost
            When the generator could not be reached: the output may be ON, and the operator must act.

        """
        if self._is_silent_and_closed:
            return
        failures: list[str] = []
        for attempt in range(2 * _STOP_ATTEMPTS):
            try:
                if attempt >= _STOP_ATTEMPTS:
                    self._reconnect()
                self._channel.output_off()
            except InstrumentError as failure:
                failures.append(str(failure))
            else:
                return
        raise InstrumentLost(
            f"THE OUTPUT OF {self._name} MAY STILL BE ON: it could not be switched off in "
            f"{2 * _STOP_ATTEMPTS} attempts, the last two over a new connection. Turn the amplifier's gain "
            f"down and switch it off now; then check cable and power of the generator ({failures[-1]})"
        )

    def close(self) -> None:
        """Output off, connection closed. Legal at any time; the connection closes in any case."""
        if self._is_silent_and_closed:
            return
        try:
            self.stop()
            self._is_silent_and_closed = True
        finally:
            self._channel.forget()
            self._port.close()

    def measured_latency_s(self) -> float:
        """How long one verified change of amplitude takes: the floor of any emergency stop [s].

        Median of nine, each setting again the amplitude that is set.
        """
        durations_s = []
        for _ in range(_LATENCY_TRIALS):
            began_s = time.perf_counter()
            self.set_amplitude(self.playing.panel_vpp / self.playing.panel_factor)
            durations_s.append(time.perf_counter() - began_s)
        return statistics.median(durations_s)

    @property
    def _name(self) -> str:
        return f"the generator at {self._config.resource}"

    def _new_port(self) -> ScpiPort:
        return ScpiPort(self._connect(), self._name, self._config.settle_s)

    def _new_channel(self) -> Afg1022Channel:
        settings = VerifiedSettings(self._port, self._name)
        return Afg1022Channel(settings, self._config.channel, self.amplitude_range_vpp[0])

    def _reconnect(self) -> None:
        with suppress(InstrumentError):  # the old session is what is broken: the new one is tried in any case
            self._port.close()
        self._port = self._new_port()
        self._channel = self._new_channel()

    def _bring_up(self) -> None:
        self._channel.output_off()
        self._unconfirmed = self._channel.agree_on_load(self._config.load_ohm)
        self._channel.to_quiet_sine()

    def _identify(self) -> None:
        self._port.send(f"OUTP{self._config.channel}:STAT OFF")
        self._port.send("*CLS")
        reply = self._port.query_patiently("*IDN?")
        fields = [field.strip() for field in reply.split(",")]
        maker, model, serial, firmware = (*fields, "", "", "", "")[:4]
        if self.answers.match(f"{maker},{model}") is None:
            raise InstrumentError(
                f"{self._config.resource} answers *IDN? with {reply!r}; {self.wanted} is needed. "
                "It was told to switch its output off; correct generator.resource in the configuration"
            )
        self._identity = Identity(maker, model, serial, firmware, reply)

    def _ensure_known(self) -> None:
        if not self._channel.is_known:
            self._channel.output_off()
            self._channel.to_quiet_sine()

    @contextmanager
    def _changing(self) -> Iterator[None]:
        """Switch off when a change fails: what the instrument then plays is nobody's intention."""
        try:
            yield
        except InstrumentError as error:
            self._channel.forget()
            try:
                self.stop()
            except InstrumentLost as shout:
                raise shout from error
            error.add_note("The output was switched off.")
            raise
        except KeyboardInterrupt:
            self._channel.forget()
            raise
