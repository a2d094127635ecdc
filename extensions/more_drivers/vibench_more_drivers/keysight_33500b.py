"""The Keysight 33500B: sines, waveforms and bursts like any other generator, and internal sweeps.

Commands: Keysight Trueform Series Operating and Service Guide, as used in public drivers. This driver was not
tested on an instrument.
"""

import re
from typing import ClassVar

import numpy as np

from vibench.acquisition.drivers import AFG1022X, SWITCH, ArbitraryCodes, GeneratorModel, Number, Word
from vibench.acquisition.errors import SettingRefused
from vibench.acquisition.instruments import Spacing, Sweep

from . import KEYSIGHT_33500B_MODEL

_NAME = "VIBENCH"
_MIDDLE = KEYSIGHT_33500B_MODEL.top_code // 2
_SPACINGS = {Spacing.LINEAR: "LIN", Spacing.LOGARITHMIC: "LOG"}
_SAME_MEAN = 1e-4
LONGEST_HOLD_S = 3600.0
"""Time for which the stop frequency is held after a sweep [s]."""


class Keysight33500B(AFG1022X):
    """A 33500B as a `FunctionGenerator`; it behaves like `AFG1022X`."""

    model: ClassVar[GeneratorModel] = KEYSIGHT_33500B_MODEL
    wanted: ClassVar[str] = "Agilent or Keysight Technologies,335..B"
    answers: ClassVar[re.Pattern[str]] = re.compile(
        r"(AGILENT|KEYSIGHT) TECHNOLOGIES,335\d\dB", re.IGNORECASE
    )
    load_header: ClassVar[str] = "OUTP{c}:LOAD"
    burst_channels: ClassVar[tuple[int, ...]] = (1, 2)

    shape = Word("SOUR{c}:FUNC", {"SIN": ("SIN",), "ARB": ("ARB",)})
    waveform = Word("SOUR{c}:FUNC:ARB", {_NAME: (_NAME,)})
    sample_rate_hz = Number("SOUR{c}:FUNC:ARB:SRAT", "{:.6f}", absolute=1e-6, relative=1e-6)
    output_filter = Word("SOUR{c}:FUNC:ARB:FILT", {"OFF": ("OFF",)})
    amplitude_unit = Word("SOUR{c}:VOLT:UNIT", {"VPP": ("VPP",)})
    byte_order = Word("FORM:BORD", {"NORM": ("NORM",)})
    trigger_source = Word("TRIG{c}:SOUR", {"BUS": ("BUS",)})
    sweep_start_hz = Number("SOUR{c}:FREQ:STAR", "{:.6f}", absolute=1.5e-6, relative=1e-6)
    sweep_stop_hz = Number("SOUR{c}:FREQ:STOP", "{:.6f}", absolute=1.5e-6, relative=1e-6)
    sweep_s = Number("SOUR{c}:SWE:TIME", "{:.6f}", absolute=1e-6, relative=1e-6)
    hold_s = Number("SOUR{c}:SWE:HTIM", "{:.6f}", absolute=1e-6, relative=1e-6)
    spacing = Word("SOUR{c}:SWE:SPAC", {"LIN": ("LIN",), "LOG": ("LOG",)})
    sweep = Word("SOUR{c}:SWE:STAT", SWITCH)
    am, fm, pm, fsk, pwm = (
        Word(f"SOUR{{c}}:{node}:STAT", SWITCH) for node in ("AM", "FM", "PM", "FSK", "PWM")
    )

    def load_sine(self, frequency_hz: float, amplitude_vpp: float) -> None:
        """Set up a sine. The output stays on or off as it was."""
        with self._changing():
            if self._is_known:
                self.sweep = "OFF"
        super().load_sine(frequency_hz, amplitude_vpp)

    def load_sweep(self, sweep: Sweep, amplitude_vpp: float) -> None:
        """Set up a sweep that a trigger starts. The output stays on or off as it was."""
        self.model.check_sweep(sweep)
        self.load_sine(sweep.start_hz, amplitude_vpp)
        with self._changing():
            self.trigger_source = "BUS"
            self.sweep_start_hz = sweep.start_hz
            self.sweep_stop_hz = sweep.stop_hz
            self.sweep_s = sweep.duration_s
            self.hold_s = LONGEST_HOLD_S
            self.spacing = _SPACINGS[sweep.spacing]
            self.sweep = "ON"

    def arm_burst(self, cycles: int) -> None:
        """Play ``cycles`` periods at each trigger command."""
        with self._changing():
            self.trigger_source = "BUS"
        super().arm_burst(cycles)

    def _end_modes(self) -> None:
        """End sweep, burst and modulation; use peak-to-peak amplitudes; switch the waveform filter off."""
        self.sweep = self.burst = self.am = self.fm = self.pm = self.fsk = self.pwm = "OFF"
        self.amplitude_unit = "VPP"
        self.output_filter = "OFF"

    def _set_frequency(self, frequency_hz: float) -> None:
        if self.codes is None:
            self.frequency_hz = frequency_hz
        else:
            self.sample_rate_hz = frequency_hz * self.codes.codes.size

    def _select(self, codes: ArbitraryCodes | None) -> None:
        if codes is not None:
            self.waveform = _NAME
        self.shape = "SIN" if codes is None else "ARB"
        self.codes = codes

    def _upload(self, codes: ArbitraryCodes) -> None:
        """Write the memory; verify the number and mean of the points, as the points cannot be read back."""
        source = f"SOUR{self.channel}:DATA"
        self.command(f"{source}:VOL:CLE")
        self.byte_order = "NORM"
        signed = (codes.codes.astype(np.int32) - _MIDDLE).astype(np.int16)
        self.command(f"{source}:ARB:DAC {_NAME},", signed.view(np.uint16))
        points, mean = (self.query_number(f"{source}:ATTR:{each}? {_NAME}") for each in ("POIN", "AVER"))
        sent_mean = float(signed.mean()) / _MIDDLE
        if round(points) != signed.size or abs(mean - sent_mean) > _SAME_MEAN:
            raise SettingRefused(
                f"{self.name}: {signed.size} points with a mean of {sent_mean:.4f} were written to its "
                f"memory, but it reports {points:g} points with a mean of {mean:.4f}. Upload the waveform "
                "again; if that fails again, check the USB cable"
            )
