"""The output of one channel: turns changes of settings into the signals of its timeline."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from . import _output_signal as output_signal
from ._afg1022_settings import DC, NOISE, ChannelSettings, RunMode
from ._arbitrary_memory import ArbitraryMemory
from ._output_signal import Panel
from ._phase_course import UHZ_PER_HZ, PhaseCourse, SteadyPhase
from ._scpi_command import Quirks
from ._terminal_voltage import Relay, Signal, Terminal, Timeline


@dataclass(frozen=True)
class OutputHabits:
    """What the output depends on besides the settings."""

    quirks: Quirks
    panel: Panel
    memory: ArbitraryMemory


class ChannelOutput:
    """Plays what the settings say, from the rig time at which they changed."""

    def __init__(self, terminal: Terminal, habits: OutputHabits, power_on: ChannelSettings) -> None:
        self._habits = habits
        carrier = SteadyPhase(round(power_on.frequency_hz * UHZ_PER_HZ), 0.0)
        self._timeline = Timeline(terminal, Signal(course=carrier, amplitude_vpp=power_on.amplitude_vpp))
        self._relay_is_stuck = False

    def render(self, start_s: float, interval_s: float, count: int) -> NDArray[np.float64]:
        """Return the mean terminal voltage over consecutive intervals, shape (count,) [V]."""
        return self._timeline.render(start_s, interval_s, count)

    def weld_relay(self, settings: ChannelSettings, now_s: float) -> None:
        """Keep the output on whatever the settings say."""
        self._relay_is_stuck = True
        self.follow(settings, settings, now_s)

    def repair_relay(self, settings: ChannelSettings, now_s: float) -> None:
        """Let the output obey its settings again."""
        self._relay_is_stuck = False
        self.follow(settings, settings, now_s)

    def jump_clock(self, by_s: float) -> None:
        """Let whatever plays jump in phase, as if that time had passed."""
        self._timeline.jump(by_s)

    def follow(self, previous: ChannelSettings, settings: ChannelSettings, now_s: float) -> None:
        """Bring the terminal in line with new settings, as of a rig time.

        The phase goes on without a jump unless the start phase itself was changed.
        """
        at_s, own_s = self._when(now_s)
        latest = self._timeline.latest
        memory = self._habits.memory
        burst = latest.burst if settings.mode is previous.mode else output_signal.waiting_burst(settings)
        signal = Signal(
            relay=Relay.CLOSED if self._relay_is_stuck else settings.relay,
            course=self._course(previous, settings, own_s),
            shape=latest.shape,
            amplitude_vpp=settings.amplitude_vpp,
            offset_v=settings.offset_v,
            envelope=output_signal.envelope(settings, memory),
            burst=burst,
            pulse_width=output_signal.pulse_width(settings, memory),
        )
        if settings.shape == DC and self._habits.quirks.dc_ignores_offset:
            signal = replace(signal, offset_v=0.0)
        if settings.shape != NOISE or not self._habits.quirks.noise_is_not_played:
            shape = output_signal.shape(settings.shape, memory, settings.duty_percent)
            signal = replace(signal, shape=shape)
        self._timeline.change(signal, at_s)

    def trigger(self, settings: ChannelSettings, now_s: float) -> None:
        """Start a waiting burst or sweep; while a burst runs, and without either mode, nothing happens."""
        at_s, own_s = self._when(now_s)
        latest = self._timeline.latest
        if settings.mode is RunMode.SWEEP:
            phase = latest.course.phase(own_s)
            course = output_signal.swept(settings, self._habits.panel, phase, own_s, own_s)
            self._timeline.change(replace(latest, course=course), at_s)
            return
        burst = output_signal.triggered_burst(settings, own_s)
        if burst is None or latest.burst is None:
            return
        if latest.burst.begin_s <= own_s < latest.burst.end_s:
            return
        course = self._course_from_start(settings, own_s)
        self._timeline.change(replace(latest, course=course, burst=burst), at_s)

    def align(self, settings: ChannelSettings, now_s: float) -> None:
        """Let the phase be the start phase now."""
        at_s, own_s = self._when(now_s)
        course = self._course_from_start(settings, own_s)
        self._timeline.change(replace(self._timeline.latest, course=course), at_s)

    def _when(self, now_s: float) -> tuple[float, float]:
        """Return when a command acts: in rig time and in the generator's own time."""
        at_s = self._timeline.effective(now_s)
        return at_s, self._timeline.own_time(at_s)

    def _course(self, previous: ChannelSettings, settings: ChannelSettings, own_s: float) -> PhaseCourse:
        """Return the course of the phase: the same object if nothing of it has changed."""
        running = self._timeline.latest.course
        if _course_key(previous) == _course_key(settings):
            return running
        turn = (settings.phase_deg - previous.phase_deg) / output_signal.DEGREES
        phase = (running.phase(own_s) + turn) % 1.0
        return output_signal.course(settings, self._habits.memory, self._habits.panel, phase, own_s)

    def _course_from_start(self, settings: ChannelSettings, own_s: float) -> PhaseCourse:
        """Return a course that is at the start phase at a given time."""
        phase = settings.phase_deg / output_signal.DEGREES % 1.0
        return output_signal.course(settings, self._habits.memory, self._habits.panel, phase, own_s)


def _course_key(settings: ChannelSettings) -> tuple[object, ...]:
    """Everything that the course of the phase depends on."""
    return (
        settings.mode,
        settings.frequency_hz,
        settings.phase_deg,
        settings.sweep_start_hz,
        settings.sweep_stop_hz,
        settings.sweep,
        settings.modulation.get(settings.mode),
    )
