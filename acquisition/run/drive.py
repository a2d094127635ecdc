"""The generator's output as a run sees it: something to play, at a level from 0 (quiet) to 1 (as planned)."""

from contextlib import suppress

import numpy as np

from ..errors import AcquisitionError, ConfigurationError
from ..excitation.plan import LOWEST_AMPLITUDE_VPP
from ..excitation.steps import Play, Stream, Tone, Waveform
from ..instruments import FunctionGenerator
from ..plan.measurement import Measurement
from .schedule import half_cosine, stairs

QUIET_VPP = 1.25 * LOWEST_AMPLITUDE_VPP
"""Amplitude of level 0 for a waveform that reaches full range: where ramps begin and end, safely above
the smallest setting that the generator takes."""


class Drive:
    """Plays what a phase wants, at a level that only a ramp changes."""

    def __init__(self, generator: FunctionGenerator, measurement: Measurement) -> None:
        self._generator = generator
        self._amplitude_vpp = measurement.excitation.amplitude_vpp
        self._stairs = stairs(measurement)
        self._play: Play | None = None
        self._level = 0.0
        self._is_on = False
        self._setting_vpp = 0.0

    @property
    def level(self) -> float:
        """Between 0, quiet, and 1, the planned amplitude."""
        return self._level

    @property
    def is_on(self) -> bool:
        """Whether the output has been turned on and not off again."""
        return self._is_on

    @property
    def amplitude_vpp(self) -> float:
        """The setting that belongs to the level [V], for what is played."""
        planned_vpp = self._planned_vpp()
        quiet_vpp = min(planned_vpp, self._quiet_vpp())
        return quiet_vpp + self._level * (planned_vpp - quiet_vpp)

    @property
    def setting_vpp(self) -> float:
        """What the output plays now [V]; 0 while it is off."""
        return self._setting_vpp if self._is_on else 0.0

    def play(self, play: Play) -> None:
        """Change what is played; the output keeps its state, and from tone to tone the phase goes on.

        Anything but a change from tone to tone must happen at level 0.
        """
        if play == self._play:
            return
        before, self._play = self._play, play
        match before, play:
            case _, Stream():
                require_playable(play)
            case Tone(_, level_before), Tone(frequency_hz, level):
                self._change_tone(frequency_hz, level_before, level)
            case _, Tone(frequency_hz, _):
                self._generator.load_sine(frequency_hz, self.amplitude_vpp)
            case _, Waveform(values, repetition_hz):
                self._generator.load_waveform(values, repetition_hz, self.amplitude_vpp)
        self._setting_vpp = self.amplitude_vpp

    def _change_tone(self, frequency_hz: float, level_before: float, level: float) -> None:
        """Lower the amplitude before the frequency changes, or raise it after: never too loud on the way."""
        if level < level_before:
            self._generator.set_amplitude(self.amplitude_vpp)
        self._generator.set_frequency(frequency_hz)
        if level > level_before:
            self._generator.set_amplitude(self.amplitude_vpp)

    def start(self) -> None:
        """Turn the output on."""
        # Before the command: should it fail half-way, the output counts as on.
        self._is_on = True
        self._generator.start()

    def start_tone(self, frequency_hz: float, amplitude_vpp: float) -> None:
        """Play a tone at an amplitude of its own, as the bench check does."""
        self._generator.load_sine(frequency_hz, amplitude_vpp)
        self._play = None
        self._setting_vpp = amplitude_vpp
        self.start()

    def set_level(self, level: float) -> None:
        """Set the level at once; a ramp is a staircase of these."""
        self._level = level
        self._setting_vpp = self.amplitude_vpp
        self._generator.set_amplitude(self._setting_vpp)

    def stop(self) -> None:
        """Turn the output off, now."""
        self._generator.stop()
        self._is_on = False
        self._level = 0.0

    def silence(self) -> None:
        """Ramp down as fast as the generator takes commands, then turn the output off, whatever happens.

        For the ways out on which no samples can be counted. Some 20 commands of a few milliseconds
        make a ramp that is short but no step.
        """
        try:
            with suppress(AcquisitionError):  # a ramp that fails leaves it to stop(), which never gives up
                self._ramp_down_blindly()
        finally:
            self.stop()

    def _ramp_down_blindly(self) -> None:
        if not self._is_on or self._level <= 0.0:
            return
        top = self._level
        for stair in range(1, self._stairs + 1):
            self.set_level(top * half_cosine(1 - stair / self._stairs))

    def _planned_vpp(self) -> float:
        match self._play:
            case Tone(_, level):
                return self._amplitude_vpp * level
            case _:
                return self._amplitude_vpp

    def _quiet_vpp(self) -> float:
        match self._play:
            case Waveform(values):
                # Generators stretch a waveform to their full range: their setting is then this much lower.
                return QUIET_VPP / float(np.max(np.abs(values)))
            case _:
                return QUIET_VPP


def require_playable(play: Play) -> None:
    """Raise ConfigurationError for what a function generator cannot play."""
    match play:
        case Stream():
            raise ConfigurationError(
                "streamed noise needs an analogue output, and this bench has none: its function generator "
                "repeats one waveform. Nothing was played; use multisine_noise with more realisations"
            )
        case Tone() | Waveform():
            return
