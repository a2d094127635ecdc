"""The Keysight 33500B: sines, waveforms and bursts as any generator of ours, and sweeps of its own.

Commands: Keysight Trueform Series Operating and Service Guide, as public drivers use them; nothing was
compared with an instrument.
"""

import re
from dataclasses import replace
from typing import ClassVar

import numpy as np

from ..errors import SettingRefused
from ..instruments import Knob, Spacing, Sweep
from ._afg1022_channel import Afg1022Channel, agree_on_load
from ._afg1022_modes import set_burst
from ._afg1022x import AFG1022X
from ._arbitrary_codes import ArbitraryCodes
from ._generator_limits import KEYSIGHT_33500B_MODEL, GeneratorModel, Load, Shape
from ._scpi import number_in
from ._verified_settings import Tolerance, VerifiedSettings

_NAME = "VIBENCH"
_MIDDLE = KEYSIGHT_33500B_MODEL.top_code // 2
_RATE = Tolerance(absolute=1e-6, relative=1e-6)
_TIME = Tolerance(absolute=1e-6, relative=1e-6)
_OFF = frozenset({"0", "OFF"})
_ON = frozenset({"1", "ON"})
_SHAPES = {Shape.SINE: ("SIN", frozenset({"SIN"})), Shape.EDIT_MEMORY: ("ARB", frozenset({"ARB"}))}
_SPACINGS = {Spacing.LINEAR: "LIN", Spacing.LOGARITHMIC: "LOG"}
_SWITCHED = ("SWE", "BURS", "AM", "FM", "PM", "FSK", "PWM")
_SAME_MEAN = 1e-4
LONGEST_HOLD_S = 3600.0
"""How long the stop frequency is held behind a sweep."""


class Keysight33500BChannel(Afg1022Channel):
    """One channel: what its commands call differently, and its sweep."""

    def switch_off_modes(self) -> None:
        """End sweep, burst and modulation; amplitudes are peak to peak, waveforms held, not smoothed."""
        for mode in _SWITCHED:
            self.settings.set_word(f"SOUR{self._channel}:{mode}:STAT", "OFF", _OFF)
        self.settings.set_word(f"SOUR{self._channel}:VOLT:UNIT", "VPP", frozenset({"VPP"}))
        self.settings.set_word(f"SOUR{self._channel}:FUNC:ARB:FILT", "OFF", frozenset({"OFF"}))

    def set_frequency(self, frequency_hz: float) -> None:
        """Set the frequency of the sine, or how often a second the waveform is played."""
        codes = self.playing.codes
        if codes is None:
            super().set_frequency(frequency_hz)
            return
        rate_hz = frequency_hz * codes.codes.size
        header = f"SOUR{self._channel}:FUNC:ARB:SRAT"
        got_hz = self.settings.set_number(header, rate_hz, f"{rate_hz:.6f}", _RATE)
        self._playing = replace(self.playing, frequency_hz=got_hz / codes.codes.size)

    def upload(self, codes: ArbitraryCodes) -> None:
        """Fill the memory; it tells the number of points and their mean, not the points."""
        port = self.settings.port
        port.command(f"SOUR{self._channel}:DATA:VOL:CLE")
        self.settings.set_word("FORM:BORD", "NORM", frozenset({"NORM"}))
        signed = (codes.codes.astype(np.int32) - _MIDDLE).astype(np.int16)
        port.write_codes(f"SOUR{self._channel}:DATA:ARB:DAC {_NAME},", signed.view(np.uint16))
        attribute = f"SOUR{self._channel}:DATA:ATTR"
        points, mean = (
            number_in(
                port.query(f"{attribute}:{each}? {_NAME}"), f"{self.settings.name}: {attribute}:{each}?"
            )
            for each in ("POIN", "AVER")
        )
        sent_mean = float(signed.mean()) / _MIDDLE
        if round(points) != signed.size or abs(mean - sent_mean) > _SAME_MEAN:
            raise SettingRefused(
                f"{self.settings.name}: {signed.size} points with a mean of {sent_mean:.4f} were put in its "
                f"memory, and it tells {points:g} with {mean:.4f}. Upload again; if it fails again, check "
                "the USB cable"
            )

    def arm_burst(self, cycles: int) -> None:
        """Play ``cycles`` periods at each trigger of the bus."""
        self._triggered_by_bus()
        set_burst(self.settings, self._channel, cycles, KEYSIGHT_33500B_MODEL)

    def end_burst(self) -> None:
        """Play on without a trigger."""
        self.settings.set_word(f"SOUR{self._channel}:BURS:STAT", "OFF", _OFF)

    def arm_sweep(self, sweep: Sweep) -> None:
        """Stay at the start frequency until a trigger, then go to the stop frequency, and hold it."""
        source = f"SOUR{self._channel}"
        self._triggered_by_bus()
        frequency = Tolerance(absolute=1.5e-6, relative=1e-6)
        for node, value, tolerance in (
            ("FREQ:STAR", sweep.start_hz, frequency),
            ("FREQ:STOP", sweep.stop_hz, frequency),
            ("SWE:TIME", sweep.duration_s, _TIME),
            ("SWE:HTIM", LONGEST_HOLD_S, _TIME),
        ):
            self.settings.set_number(f"{source}:{node}", value, f"{value:.6f}", tolerance)
        word = _SPACINGS[sweep.spacing]
        self.settings.set_word(f"{source}:SWE:SPAC", word, frozenset({word}))
        self.settings.set_word(f"{source}:SWE:STAT", "ON", _ON)

    def end_sweep(self) -> None:
        """Play one frequency."""
        self.settings.set_word(f"SOUR{self._channel}:SWE:STAT", "OFF", _OFF)

    def agree_on_load(self, load: Load) -> tuple[Knob, ...]:
        """Make the generator expect ``load``."""
        return agree_on_load(self.settings.port, f"OUTP{self._channel}:LOAD", load)

    def _triggered_by_bus(self) -> None:
        self.settings.set_word(f"TRIG{self._channel}:SOUR", "BUS", frozenset({"BUS"}))

    def _select(self, shape: Shape, codes: ArbitraryCodes | None) -> None:
        if codes is not None:
            self.settings.set_word(f"SOUR{self._channel}:FUNC:ARB", _NAME, frozenset({_NAME}))
        word, answers = _SHAPES[shape]
        self.settings.set_word(f"SOUR{self._channel}:FUNC", word, answers)
        self._playing = replace(self.playing, shape=shape, codes=codes)


class Keysight33500B(AFG1022X):
    """A 33500B as a `FunctionGenerator`: see `AFG1022X` for what it promises."""

    model: ClassVar[GeneratorModel] = KEYSIGHT_33500B_MODEL
    wanted: ClassVar[str] = "Agilent or Keysight Technologies,335..B"
    answers: ClassVar[re.Pattern[str]] = re.compile(
        r"(AGILENT|KEYSIGHT) TECHNOLOGIES,335\d\dB", re.IGNORECASE
    )
    _channel: Keysight33500BChannel

    def load_sine(self, frequency_hz: float, amplitude_vpp: float) -> None:
        """Set up a sine. The output keeps its state."""
        self._end_sweep()
        super().load_sine(frequency_hz, amplitude_vpp)

    def load_sweep(self, sweep: Sweep, amplitude_vpp: float) -> None:
        """Set up a sweep that a trigger starts. The output keeps its state."""
        self.model.check_sweep(sweep)
        self.load_sine(sweep.start_hz, amplitude_vpp)
        with self._changing():
            self._channel.arm_sweep(sweep)

    def _end_sweep(self) -> None:
        with self._changing():
            if self._channel.is_known:
                self._channel.end_sweep()

    def _new_channel(self) -> Keysight33500BChannel:
        settings = VerifiedSettings(self._port, self._name)
        return Keysight33500BChannel(settings, self._config.channel, self.amplitude_range_vpp[0])
