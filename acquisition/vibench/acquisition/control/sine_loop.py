"""One sine at a time, played and measured: the actions that all feedback is made of."""

from collections.abc import Generator
from dataclasses import dataclass
from math import ceil

import numpy as np

from ..excitation.feedback import BaseLevel
from ..excitation.settled_sine import GLIDE_TONE_S
from ..excitation.steps import Segment, Tone
from ..plan import HUSH_S, Measurement, Phase, RunState, lowest_setting_vpp, needed_vpp, ramp
from ..recording import FeedbackNote
from ..rig import OnTable, Rig
from .control_action import ControlAction, Controller, PhaseSamples
from .feedback_channels import BridgedRows, FeedbackChannels, require_answer
from .gain_estimator import GainEstimator
from .steadiness import Periods, Stroboscope


@dataclass(frozen=True)
class DriveSetting:
    """What the generator is set to."""

    frequency_hz: float
    setting_vpp: float


class SineLoop:
    """Knows what is played, and looks at it once a period."""

    def __init__(self, channels: FeedbackChannels, rig: Rig, measurement: Measurement) -> None:
        self.measurement = measurement
        self._notes: list[FeedbackNote] = []
        self._scope: Stroboscope
        self._silence = np.zeros(0)
        self._rows = BridgedRows(channels.sample_rate_hz)
        self.channels = channels
        self.rig = rig
        self.most_vpp = measurement.excitation.amplitude_vpp
        """Largest setting of the plan [V]."""
        self.drives = 1
        """Periods of the drive in one of the motion that is looked at; set before anything is played."""
        self.judged_order: int | None = None
        """Of the response, if one alone tells whether the motion has settled; likewise."""
        self.least_vpp = lowest_setting_vpp(measurement, rig)
        """Smallest setting of what plays [V]."""
        self.setting = DriveSetting(0.0, self.least_vpp)
        self.elapsed_s = 0.0
        """Listened so far [s]."""

    @property
    def periods(self) -> Periods:
        """What was seen since the last change."""
        return self._scope.periods()

    @property
    def drive_hz(self) -> float:
        """Frequency of the drive in the converter's time [Hz]."""
        return self._scope.clock.frequency_hz

    @property
    def motion_hz(self) -> float:
        """One over the period of the motion that is looked at [Hz]."""
        return self.setting.frequency_hz / self.drives

    @property
    def noise(self) -> float:
        """Rms of the response channel's own noise, in the orders seen at the frequency of now [m/s]."""
        return Stroboscope.noise_of(self._silence, self.motion_hz, self.channels.sample_rate_hz)

    def listen_to_silence(self) -> Controller[None]:
        """Listen to silence: what the response shows then is noise."""
        samples = yield from self.run_phase(Phase(RunState.ARMED, None, HUSH_S))
        _, _, response = self.channels.rows(samples)
        # The first half lets the bench check ring out.
        self._silence = response[len(response) // 2 :]

    def change(self, frequency_hz: float, setting_vpp: float) -> None:
        """Play something else from the next move on."""
        if frequency_hz != self.setting.frequency_hz:
            self._scope = self.channels.stroboscope(frequency_hz, self.drives)
            self._rows.skip()
        self.setting = DriveSetting(frequency_hz, setting_vpp)
        self.forget()

    def bounded_vpp(self, setting_vpp: float) -> float:
        """Keep a setting between the generator's smallest and the plan's largest [V]."""
        return min(max(setting_vpp, self.least_vpp), self.most_vpp)

    def forget(self) -> None:
        """Look anew from the next move on."""
        self._scope.forget()

    def note(self, note: FeedbackNote) -> None:
        """Have something noted with the next move."""
        self._notes.append(note)

    def ramp_up(self) -> Controller[None]:
        """Begin to play."""
        yield from self.run_phase(ramp(RunState.RAMPING_UP, self._tone, self.measurement))

    def ramp_down(self) -> Controller[None]:
        """End the play."""
        yield from self.run_phase(ramp(RunState.RAMPING_DOWN, self._tone, self.measurement))

    def listen(self, state: RunState, duration_s: float, segment: Segment | None = None) -> Controller[None]:
        """Play on for a while, and look."""
        samples = yield from self.run_phase(Phase(state, self._tone, duration_s, segment))
        self.elapsed_s += duration_s
        first_sample, rows = self._rows.take(samples.first_sample, np.stack(self.channels.rows(samples)))
        if rows.size:
            self._scope.add(first_sample, *rows)

    def say(self) -> Controller[None]:
        """Have everything noted that is still to be noted."""
        if self._notes:
            yield ControlAction(None, self._taken_notes())

    def run_phase(self, phase: Phase) -> Generator[ControlAction, PhaseSamples, PhaseSamples]:
        """Have a phase carried out, with what is to be noted at its first sample."""
        return (yield ControlAction(phase, self._taken_notes()))

    def _taken_notes(self) -> tuple[FeedbackNote, ...]:
        notes = tuple(self._notes)
        self._notes.clear()
        return notes

    @property
    def _tone(self) -> Tone:
        return Tone(self.setting.frequency_hz, self.setting.setting_vpp / self.most_vpp)


_GLIDE_MEMORY_S = 0.5
"""Over which a glide averages the base's answer [s]."""


def started(loop: SineLoop, frequency_hz: float, level: BaseLevel | None) -> Controller[None]:
    """Ramp up at a frequency: to the level, as the rig's model has it, or to the plan's setting."""
    setting_vpp = loop.most_vpp
    if level is not None:
        guess_vpp = _bare_vpp(loop, level, frequency_hz)
        setting_vpp = loop.bounded_vpp(guess_vpp)
    loop.change(frequency_hz, setting_vpp)
    yield from loop.listen_to_silence()
    yield from loop.ramp_up()


def glided(loop: SineLoop, frequency_hz: float, level: BaseLevel | None, step_hz: float) -> Controller[None]:
    """Go to another frequency through others at most ``step_hz`` apart: a large step would be a kick."""
    begin_hz = loop.setting.frequency_hz
    tones = max(1, ceil(abs(frequency_hz - begin_hz) / step_hz * (1 - 1e-9)))
    estimator = GainEstimator(_GLIDE_MEMORY_S)
    for tone in range(1, tones):
        tracked(loop, begin_hz + (frequency_hz - begin_hz) * tone / tones, level, estimator, GLIDE_TONE_S)
        yield from loop.listen(RunState.SETTLING, GLIDE_TONE_S)
        followed(loop, level, estimator)
    tracked(loop, frequency_hz, level, estimator, GLIDE_TONE_S)


def moved(loop: SineLoop, frequency_hz: float, level: BaseLevel | None) -> None:
    """Play another frequency: the setting follows the rig's model from where it is."""
    setting_vpp = loop.setting.setting_vpp
    if level is not None:
        setting_vpp *= _bare_vpp(loop, level, frequency_hz)
        setting_vpp /= _modelled_vpp(loop, level)
    _change(loop, frequency_hz, setting_vpp, level)


def tracked(
    loop: SineLoop, frequency_hz: float, level: BaseLevel | None, estimator: GainEstimator, duration_s: float
) -> None:
    """Play another frequency for ``duration_s``, at the setting that the track foresees for its middle."""
    if level is None or not estimator.is_known:
        moved(loop, frequency_hz, level)
        return
    modelled_vpp = _bare_vpp(loop, level, frequency_hz)
    gain = estimator.gain_at(loop.elapsed_s + 0.5 * duration_s)
    _change(loop, frequency_hz, modelled_vpp / gain, level)


def followed(loop: SineLoop, level: BaseLevel | None, estimator: GainEstimator) -> None:
    """Take what was just heard into the track."""
    if level is None:
        return
    now = loop.setting
    if loop.periods.count:
        acceleration = abs(complex(np.mean(loop.periods.base)))
        require_answer(loop.rig, now.frequency_hz, now.setting_vpp, acceleration)
    target = level.acceleration_at(now.frequency_hz)
    modelled = target * now.setting_vpp / _modelled_vpp(loop, level)
    estimator.add(loop.elapsed_s, loop.periods.base, modelled, target)


def _modelled_vpp(loop: SineLoop, level: BaseLevel) -> float:
    """Give the setting that the bare table needs for the level at the frequency of now [V]."""
    return _bare_vpp(loop, level, loop.setting.frequency_hz)


def _bare_vpp(loop: SineLoop, level: BaseLevel, frequency_hz: float) -> float:
    return needed_vpp(loop.rig, level.acceleration_at(frequency_hz), frequency_hz, OnTable.NOTHING)


def _change(loop: SineLoop, frequency_hz: float, wanted_vpp: float, level: BaseLevel | None) -> None:
    """Change frequency and setting, the latter by no more than the level allows at once."""
    if level is not None:
        now_vpp = loop.setting.setting_vpp
        slow_vpp = min(max(wanted_vpp, now_vpp / level.most_change), now_vpp * level.most_change)
        wanted_vpp = loop.bounded_vpp(slow_vpp)
    loop.change(frequency_hz, wanted_vpp)
