"""Function generator as a drive: one command per change; a ramp is a staircase of amplitudes."""

import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from itertools import takewhile

import numpy as np

from ..errors import AcquisitionError, ConfigurationError
from ..excitation.steps import Play, Stream, Tone, Waveform, full_level
from ..instruments import FunctionGenerator, Sweep
from ..plan import (
    CHECK_FREQUENCY_HZ,
    FEWEST_STAIRS,
    DriveSource,
    Measurement,
    Phase,
    RunState,
    half_cosine,
    stairs,
)

QUIET = 1.25
"""Setting at level 0, where ramps start and end, relative to the generator's smallest setting (for a waveform
of full range)."""


GUARD_S = 0.02
"""Pause between the end of a burst and the next trigger [s]. The effect of a trigger during a burst is not
documented for every firmware, and reading times vary by some milliseconds."""
CHECK_MARGIN_S = 0.5
"""Extra length of a check's burst [s], to allow for commands and the reading of samples."""
LITTLE = 0.98
"""Ratio of new to old level below which the level is lowered before a change of frequency."""
MOST_CYCLES = 50_000
_BLIND_S = 0.1
"""Duration of a ramp during which no samples are read [s]."""
_ROUNDING_S = 1e-9


class DeadMan:
    """Dead man's switch: a sine in bursts, which ends unless the process triggers the next burst.

    See docs/decisions/0030-dead-man.md.
    """

    def __init__(self, generator: FunctionGenerator, longest_s: float) -> None:
        self._generator = generator
        self._longest_s = longest_s
        self._period_s = 0.0
        self._left_s = 0.0

    def arm(self, frequency_hz: float, check_s: float = 0.0) -> None:
        """Prepare bursts of whole periods while the output is off or quiet.

        A check of ``check_s`` is played as one longer burst, because a gap would change its results.
        """
        longest_s = max(self._longest_s, check_s + CHECK_MARGIN_S if check_s else 0.0)
        cycles = max(1, min(MOST_CYCLES, int(longest_s * frequency_hz)))
        self._period_s = cycles / frequency_hz + GUARD_S
        self._generator.arm_burst(cycles)

    def trigger(self) -> None:
        """Trigger the next burst of the sine."""
        self._generator.trigger()
        self._left_s = self._period_s

    def pieces(self, duration_s: float) -> Iterator[float]:
        """Yield the parts of a duration; trigger each burst after the end of the last burst."""
        while duration_s > _ROUNDING_S:
            piece_s = min(duration_s, self._left_s)
            yield piece_s
            duration_s -= piece_s
            self._left_s -= piece_s
            if self._left_s <= _ROUNDING_S:
                self.trigger()


class GeneratorDrive:
    """A `Drive` whose commands take effect at once; the first command of a phase is sent at its start."""

    drive_source = DriveSource.GENERATOR
    is_commanded = True
    coefficients = ()
    pause_s = 0.0
    """Zero, because a generator needs no announcement [s]."""

    def __init__(
        self, generator: FunctionGenerator, measurement: Measurement, dead_man: DeadMan | None = None
    ) -> None:
        self._generator = generator
        self._dead_man = dead_man
        self._amplitude_vpp = measurement.excitation.amplitude_vpp
        self._stairs = stairs(measurement)
        self._play: Play | None = None
        self._level = 0.0
        self._is_on = False
        self._setting_vpp = 0.0
        self._setting_takes_s = 0.0
        self._check_s = 0.0

    @property
    def can_hold(self) -> bool:
        """Whether the signal continues without further commands; false for bursts and sweeps."""
        return self._dead_man is None and not isinstance(self._play, Sweep)

    @property
    def setting_vpp(self) -> float:
        """Amplitude setting while the output is on [Vpp]; 0 while it is off."""
        return self._setting_vpp if self._is_on else 0.0

    @property
    def is_playing(self) -> bool:
        """Whether the output is on, at a level above 0."""
        return self._is_on and self._level > 0.0

    def arm(self, coming: Iterable[Phase]) -> None:
        """Store the duration of the check's sine, while the output is off."""
        checking = takewhile(lambda phase: phase.state is RunState.CHECKING, coming)
        self._check_s = sum(phase.duration_s for phase in checking if phase.play is not None)

    def announce(self, coming: Iterable[Phase]) -> None:
        """Do nothing, because a generator prepares nothing in advance."""

    def perform(self, phase: Phase) -> Iterator[float]:
        """Send the commands of a phase; after each, yield the time to read until the next command [s]."""
        match phase.state:
            case RunState.CHECKING | RunState.ARMED:
                self._sound(phase.play)
                yield phase.duration_s
            case RunState.RAMPING_UP:
                self._begin(phase.play)
                yield from self._ramp(phase.end_level, phase.duration_s, self._stairs)
            case RunState.RAMPING_DOWN:
                yield from self._ramp(phase.end_level, phase.duration_s, self._stairs)
            case _:
                self._begin(phase.play)
                if phase.state is RunState.RECORDING and isinstance(phase.play, Sweep):
                    self._generator.trigger()
                yield from self._pieces(phase.duration_s)

    def ramp_down(self, ramp_s: float, clock_s: Callable[[], float]) -> Iterator[float]:
        """Ramp down from the present level in as many steps as time allows; yield each step's duration [s].

        Steps whose time has passed are skipped, but no step exceeds 1/`FEWEST_STAIRS` of the ramp.
        """
        top, count, began_s, stair = self._level, self._stairs_within(ramp_s), clock_s(), 0
        while stair < count:
            passed = int(count * (clock_s() - began_s) / ramp_s)
            stair = min(count, max(stair + 1, min(passed, stair + count // FEWEST_STAIRS)))
            self._set_level(top * half_cosine(1 - stair / count))
            yield from self._pieces(max(0.0, began_s + ramp_s * stair / count - clock_s()))

    def cut(self) -> None:
        """Turn the output off at once."""
        self._generator.stop()
        if self._is_on and self._dead_man is not None:
            self._generator.end_burst()
        self._is_on = False

    def silence(self) -> None:
        """Ramp down as fast as the generator takes commands; in any case, turn the output off afterwards.

        Used when the run ends without sampling, or if a drive signal is still measured after switching off.
        The ramp has about 20 commands of a few milliseconds each, or four on a slow generator. If the output
        was off already or the ramp failed, the amplitude is lowered too, because a stuck relay reads as off.
        """
        was_off = not self._is_on
        try:
            with suppress(AcquisitionError):  # after a failed ramp, `cut` still switches off
                self._ramp_down_blindly()
        finally:
            self.cut()
        if self._setting_vpp > self._quiet_vpp() and (was_off or self._level > 0.0):
            with suppress(AcquisitionError):
                quiet_vpp = self._quiet_vpp()
                try:
                    self._generator.set_amplitude(quiet_vpp)
                except AcquisitionError:  # after a failed change, the settings are unknown
                    self._generator.load_sine(CHECK_FREQUENCY_HZ, quiet_vpp)
                self._level, self._setting_vpp = 0.0, quiet_vpp
            self.cut()

    def _sound(self, play: Play | None) -> None:
        """Play the small sine of the check without a ramp; for any other signal, turn the output off."""
        match play:
            case Tone(frequency_hz, _):
                if not self._is_on:
                    self._setting_vpp = self._amplitude_vpp * full_level(play)
                    self._generator.load_sine(frequency_hz, self._setting_vpp)
                    self._begin_bursts(play, self._check_s)
            case _:
                if self._is_on:
                    self.cut()

    def _begin(self, play: Play | None) -> None:
        """Change the signal, and turn the output on if needed.

        Changes between tones keep the phase continuous; all other changes must be made at level 0.
        """
        if play != self._play:
            self._load(play)
        if not self._is_on:
            self._begin_bursts(play)

    def _begin_bursts(self, play: Play | None, check_s: float = 0.0) -> None:
        """Turn the output on; with a dead man's switch, also trigger the first burst."""
        match play:
            case Tone(frequency_hz, _) if self._dead_man is not None:
                self._dead_man.arm(frequency_hz, check_s)
                self._start()
                self._dead_man.trigger()
            case _:
                self._start()

    def _pieces(self, duration_s: float) -> Iterator[float]:
        return iter((duration_s,)) if self._dead_man is None else self._dead_man.pieces(duration_s)

    def _load(self, play: Play | None) -> None:
        before, self._play = self._play, play
        match before, play:
            case Tone() as old, Tone() as new:
                self._change_tone(old, new)
            case _, Tone(frequency_hz, _):
                self._generator.load_sine(frequency_hz, self._due_vpp)
            case _, Sweep() as sweep:
                self._generator.load_sweep(sweep, self._due_vpp)
            case _, Waveform(values, repetition_hz):
                self._generator.load_waveform(values, repetition_hz, self._due_vpp)
            case _, Stream() | None:
                raise ConfigurationError(
                    "a function generator cannot play a stream. Its output was not changed; "
                    "open the bench with an analogue output"
                )
        self._setting_vpp = self._due_vpp

    def _change_tone(self, old: Tone, new: Tone) -> None:
        """Change amplitude and frequency; for safety, lower the amplitude first or raise it last.

        Between steps of a sweep, a small decrease of amplitude also comes last, so the frequency is on time.
        """
        if new.level < LITTLE * old.level:
            self._generator.set_amplitude(self._due_vpp)
        if new.frequency_hz != old.frequency_hz:
            self._generator.set_frequency(new.frequency_hz)
        if new.level > old.level or LITTLE * old.level <= new.level < old.level:
            self._generator.set_amplitude(self._due_vpp)

    def _ramp(self, target: float, ramp_s: float, count: int) -> Iterator[float]:
        begin = self._level
        for stair in range(1, count + 1):
            self._set_level(begin + (target - begin) * half_cosine(stair / count))
            yield from self._pieces(ramp_s / count)

    def _stairs_within(self, ramp_s: float) -> int:
        """Return how many ramp steps fit into ``ramp_s``, given the duration of the last command."""
        made = self._stairs if self._setting_takes_s == 0.0 else int(ramp_s / self._setting_takes_s)
        return min(self._stairs, max(FEWEST_STAIRS, made))

    def _start(self) -> None:
        # Set this before the command: if the command fails half-way, the output may be on.
        self._is_on = True
        self._generator.start()

    def _set_level(self, level: float) -> None:
        self._level = level
        self._setting_vpp = self._due_vpp
        began_s = time.monotonic()
        self._generator.set_amplitude(self._setting_vpp)
        self._setting_takes_s = time.monotonic() - began_s

    def _ramp_down_blindly(self) -> None:
        if not self.is_playing:
            return
        top, count = self._level, self._stairs_within(_BLIND_S)
        for stair in range(1, count + 1):
            self._set_level(top * half_cosine(1 - stair / count))

    @property
    def _due_vpp(self) -> float:
        """Amplitude setting for the present level and signal [Vpp]."""
        planned_vpp = self._amplitude_vpp * full_level(self._play)
        quiet_vpp = min(planned_vpp, self._quiet_vpp())
        return quiet_vpp + self._level * (planned_vpp - quiet_vpp)

    def _quiet_vpp(self) -> float:
        quiet_vpp = QUIET * self._generator.amplitude_range_vpp[0]
        if isinstance(self._play, Waveform):
            # Generators scale a waveform to full range: the setting is this amplitude times the peak.
            return quiet_vpp / float(np.max(np.abs(self._play.values)))
        return quiet_vpp
