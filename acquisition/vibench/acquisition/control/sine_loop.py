"""Play one sine at a time and measure the motion: the actions that controllers share."""

from collections import deque
from collections.abc import Generator
from dataclasses import dataclass
from math import ceil, pi

import numpy as np

from vibench.sim import PhaseReference

from ..excitation.plan import BaseLevel
from ..excitation.stepped_sine import GLIDE_TONE_S, HeldResponse
from ..excitation.steps import Segment, Tone
from ..plan import HUSH_S, Measurement, Phase, RunState, look_s, lowest_setting_vpp, needed_vpp, ramp
from ..recording import FeedbackNote, HeldResponseNote, Hold
from ..rig import OnTable, Rig
from .control_action import ControlAction, Controller, PhaseSamples, measured_level
from .feedback_channels import BridgedRows, FeedbackChannels, require_answer
from .steadiness import ORDERS, Periods, Phasors, Stroboscope

_SURE = 4.0
"""Ratio of the gain's trend to its standard uncertainty above which the trend is extrapolated."""
_FEWEST = 3
"""Smallest number of drive steps from which the trend of the gain and its scatter are estimated."""


@dataclass(frozen=True)
class _Answer:
    time_s: float
    gain: complex
    """Ratio of measured base acceleration to the prediction of the rig's linear model."""
    level: complex
    """Ratio of measured to target base acceleration."""


class GainEstimator:
    """Recent gain from generator setting to base motion, relative to the linear model of the rig.

    In a chaotic motion, the fundamental of a few periods is mostly random, so recent steps (the track) are
    averaged. If the gain changes steadily (near a resonance), a line through the gains is extrapolated.
    """

    def __init__(self, memory_s: float) -> None:
        self._memory_s = memory_s
        self._answers: deque[_Answer] = deque()

    def add(self, time_s: float, base: Phasors, modelled: float, target: float) -> None:
        """Add the base phasors of a step, shape (periods,) [m/s2].

        ``modelled`` is the base acceleration by the linear model, ``target`` the acceleration to be held.
        """
        if not len(base):
            return
        mean = complex(np.mean(base))
        self._answers.append(_Answer(time_s, mean / modelled, mean / target))
        while self._answers[0].time_s < time_s - self._memory_s * (1 - 1e-9):
            self._answers.popleft()

    @property
    def is_known(self) -> bool:
        """Whether at least one step of the drive has been measured."""
        return bool(self._answers)

    @property
    def level(self) -> float:
        """Amplitude of the base, averaged over recent steps of the drive, as a fraction of its target."""
        return float(abs(np.mean([each.level for each in self._answers]))) if self._answers else 1.0

    def gain_at(self, time_s: float) -> float:
        """Return the predicted magnitude of the gain relative to the model; 1 if nothing was measured yet."""
        if not self._answers:
            return 1.0
        gain = np.array([each.gain for each in self._answers])
        mean = complex(gain.mean())
        if len(gain) < _FEWEST:
            return abs(mean)
        since_s = np.array([each.time_s for each in self._answers])
        away_s = since_s - since_s.mean()
        spread = float(away_s @ away_s)
        slope = complex(away_s @ gain) / spread
        left = gain - mean - slope * away_s
        slope_u = float(np.sqrt(np.sum(np.abs(left) ** 2) / (len(gain) - 2) / spread))
        if abs(slope) <= _SURE * slope_u:
            return abs(mean)
        return abs(mean + slope * (time_s - float(since_s.mean())))


@dataclass(frozen=True)
class DriveSetting:
    """Drive frequency and amplitude setting (peak to peak) of the generator."""

    frequency_hz: float
    setting_vpp: float


class SineLoop:
    """Loop that sets the drive and evaluates the motion once per period."""

    def __init__(self, channels: FeedbackChannels, rig: Rig, measurement: Measurement) -> None:
        self.measurement = measurement
        self._notes: list[FeedbackNote] = []
        self._scope: Stroboscope
        self._silence = np.zeros(0)
        self._rows = BridgedRows(channels.sample_rate_hz)
        self.channels = channels
        self.rig = rig
        self.most_vpp = measurement.excitation.amplitude_vpp
        """Largest amplitude setting that the plan allows [Vpp]."""
        self.drives = 1
        """Number of drive periods in one period of the motion; set before anything is played."""
        self.settling_order: int | None = None
        """The only order of the response that determines settling; None if all orders determine it. Set
        before anything is played."""
        self.least_vpp = lowest_setting_vpp(measurement, rig)
        """Smallest amplitude setting of the generator [Vpp]."""
        self.setting = DriveSetting(0.0, self.least_vpp)
        self.elapsed_s = 0.0
        """Total duration of the samples so far [s]."""

    @property
    def periods(self) -> Periods:
        """Periods since the last change of the drive, with the response of m0 as a velocity [m/s]."""
        found = self._scope.periods()
        return Periods(found.base, found.response * self._to_velocity)

    @property
    def drive_hz(self) -> float:
        """Frequency of the drive by the converter's clock [Hz]."""
        return self._scope.clock.frequency_hz

    @property
    def motion_hz(self) -> float:
        """Frequency at which the motion repeats [Hz]."""
        return self.setting.frequency_hz / self.drives

    @property
    def noise(self) -> float:
        """Upper bound on the rms noise of m0's velocity at the measured orders of the frequency [m/s]."""
        rms = Stroboscope.noise_of(self._silence, self.motion_hz, self.channels.sample_rate_hz)
        return rms * float(np.max(np.abs(self._to_velocity)))

    @property
    def _to_velocity(self) -> Phasors:
        orders_hz = np.arange(ORDERS) * self._scope.clock.frequency_hz / self.drives
        return self.channels.velocity_over_response(orders_hz)

    def listen_to_silence(self) -> Controller[None]:
        """Sample without drive, to measure the noise of the response."""
        samples = yield from self.run_phase(Phase(RunState.ARMED, None, HUSH_S))
        _, _, response = self.channels.rows(samples)
        # Leave out the first half of this silence, in which the vibration from the bench check decays.
        self._silence = response[len(response) // 2 :]

    def change(self, frequency_hz: float, setting_vpp: float) -> None:
        """Change frequency and amplitude setting of the drive from the next phase on."""
        if frequency_hz != self.setting.frequency_hz:
            self._scope = Stroboscope(frequency_hz, self.channels.sample_rate_hz, self.drives)
            self._rows.skip()
        self.setting = DriveSetting(frequency_hz, setting_vpp)
        self.forget()

    def bounded_vpp(self, setting_vpp: float) -> float:
        """Return a setting, limited to the generator's smallest and the plan's largest setting [Vpp]."""
        return min(max(setting_vpp, self.least_vpp), self.most_vpp)

    def require_answer(self, acceleration: float) -> None:
        """Raise LimitExceeded if the base's fundamental ``acceleration`` [m/s2] is too small."""
        require_answer(self.rig, self.setting.frequency_hz, self.setting.setting_vpp, acceleration)

    def forget(self) -> None:
        """Discard the measured periods, so that only later periods are evaluated."""
        self._scope.forget()

    def note(self, note: FeedbackNote) -> None:
        """Store a note, which is written at the start of the next phase."""
        self._notes.append(note)

    def ramp_up(self) -> Controller[None]:
        """Ramp the drive up to its present amplitude setting."""
        yield from self.run_phase(ramp(RunState.RAMPING_UP, self._tone, self.measurement))

    def ramp_down(self) -> Controller[None]:
        """Ramp the drive down, and write all stored notes."""
        yield from self.run_phase(ramp(RunState.RAMPING_DOWN, self._tone, self.measurement))
        yield from self.say()

    def listen(self, state: RunState, duration_s: float, segment: Segment | None = None) -> Controller[None]:
        """Continue the drive unchanged for ``duration_s`` and evaluate the motion."""
        samples = yield from self.run_phase(Phase(state, self._tone, duration_s, segment))
        self.elapsed_s += duration_s
        first_sample, rows = samples.first_sample, np.stack(self.channels.rows(samples))
        if self.channels.response_derivatives == 0:
            first_sample, rows = self._rows.take(first_sample, rows)
        if rows.size:
            self._scope.add(first_sample, *rows)

    def say(self) -> Controller[None]:
        """Write all stored notes without sampling."""
        if self._notes:
            yield ControlAction(None, self._take_notes())

    def run_phase(self, phase: Phase) -> Generator[ControlAction, PhaseSamples, PhaseSamples]:
        """Play a phase and return its samples; stored notes are written at its first sample."""
        return (yield ControlAction(phase, self._take_notes()))

    def _take_notes(self) -> tuple[FeedbackNote, ...]:
        notes = tuple(self._notes)
        self._notes.clear()
        return notes

    @property
    def _tone(self) -> Tone:
        return Tone(self.setting.frequency_hz, self.setting.setting_vpp / self.most_vpp)


_GLIDE_MEMORY_S = 0.5
"""Time over which the gain is averaged while the frequency moves [s]."""


def start(loop: SineLoop, frequency_hz: float, level: BaseLevel | None) -> Controller[None]:
    """Ramp up to the setting that the model predicts for ``level``; if None, to the plan's setting."""
    wanted_vpp = loop.most_vpp if level is None else _bare_vpp(loop, level, frequency_hz)
    yield from _start_at(loop, frequency_hz, wanted_vpp)


def _start_at(loop: SineLoop, frequency_hz: float, wanted_vpp: float) -> Controller[None]:
    loop.change(frequency_hz, loop.bounded_vpp(wanted_vpp))
    yield from loop.listen_to_silence()
    yield from loop.ramp_up()


def glide(loop: SineLoop, frequency_hz: float, level: BaseLevel | None, step_hz: float) -> Controller[None]:
    """Move to ``frequency_hz`` in steps of at most ``step_hz``, because larger steps disturb the motion."""
    begin_hz = loop.setting.frequency_hz
    tones = max(1, ceil(abs(frequency_hz - begin_hz) / step_hz * (1 - 1e-9)))
    estimator = GainEstimator(_GLIDE_MEMORY_S)
    for tone in range(1, tones):
        track(loop, begin_hz + (frequency_hz - begin_hz) * tone / tones, level, estimator, GLIDE_TONE_S)
        yield from loop.listen(RunState.SETTLING, GLIDE_TONE_S)
        update_track(loop, level, estimator)
    track(loop, frequency_hz, level, estimator, GLIDE_TONE_S)


def move(loop: SineLoop, frequency_hz: float, level: BaseLevel | None) -> None:
    """Change the frequency. If a base level is held, scale the amplitude setting by the rig's model."""
    setting_vpp = loop.setting.setting_vpp
    if level is not None:
        setting_vpp *= _bare_vpp(loop, level, frequency_hz)
        setting_vpp /= _bare_vpp(loop, level, loop.setting.frequency_hz)
    _change(loop, frequency_hz, setting_vpp, level)


def track(
    loop: SineLoop, frequency_hz: float, level: BaseLevel | None, estimator: GainEstimator, duration_s: float
) -> None:
    """Set the frequency for the next ``duration_s``, at the setting predicted for the middle of that time."""
    if level is None or not estimator.is_known:
        move(loop, frequency_hz, level)
        return
    modelled_vpp = _bare_vpp(loop, level, frequency_hz)
    gain = estimator.gain_at(loop.elapsed_s + 0.5 * duration_s)
    _change(loop, frequency_hz, modelled_vpp / gain, level)


def update_track(loop: SineLoop, level: BaseLevel | None, estimator: GainEstimator) -> None:
    """Add the newest periods to the gain estimate; do nothing if no base level is held."""
    if level is None:
        return
    now = loop.setting
    if loop.periods.count:
        loop.require_answer(abs(complex(np.mean(loop.periods.base))))
    target = level.acceleration_at(now.frequency_hz)
    modelled = target * now.setting_vpp / _bare_vpp(loop, level, now.frequency_hz)
    estimator.add(loop.elapsed_s, loop.periods.base, modelled, target)


def _bare_vpp(loop: SineLoop, level: BaseLevel, frequency_hz: float) -> float:
    """Return the amplitude setting for the base level at a frequency and an empty table [Vpp]."""
    return needed_vpp(loop.rig, level.acceleration_at(frequency_hz), frequency_hz, OnTable.NOTHING)


def _change(loop: SineLoop, frequency_hz: float, wanted_vpp: float, level: BaseLevel | None) -> None:
    """Change frequency and setting. To hold a level, ``most_change`` limits the change of the setting."""
    if level is not None:
        now_vpp = loop.setting.setting_vpp
        slow_vpp = min(max(wanted_vpp, now_vpp / level.most_change), now_vpp * level.most_change)
        wanted_vpp = loop.bounded_vpp(slow_vpp)
    loop.change(frequency_hz, wanted_vpp)


_PROMPT = 0.8
"""Fraction of the amplitude error of m0 [dB] that one correction of the drive removes."""
_IN_A_ROW = 2


def hold_response(loop: SineLoop, plan: HeldResponse) -> Controller[None]:
    """Ramp up to a low level. At each frequency, bring m0 to ``response_m``, then record (decision 0066)."""
    passes = tuple(plan.passes())
    yield from _start_at(loop, passes[0][1][0], plan.start_share * loop.most_vpp)
    for direction, frequencies_hz in passes:
        for frequency_hz in frequencies_hz:
            if frequency_hz != loop.setting.frequency_hz:
                yield from glide(loop, frequency_hz, None, plan.glide_step_hz)
            yield from _bring_to_response(loop, plan)
            yield from _record(loop, plan, frequency_hz, direction)
    yield from loop.ramp_down()


def _bring_to_response(loop: SineLoop, plan: HeldResponse) -> Controller[None]:
    frequency_hz, waited_s, in_a_row = loop.setting.frequency_hz, 0.0, 0
    stretch_s = look_s(frequency_hz)
    while in_a_row < _IN_A_ROW and waited_s + stretch_s <= plan.longest_wait_s:
        yield from loop.listen(RunState.SETTLING, stretch_s)
        waited_s += stretch_s
        response_m, _, base = response_of(loop, plan)
        loop.require_answer(base)
        wanted = plan.response_m / max(response_m, 1e-15)
        in_a_row = in_a_row + 1 if abs(wanted - 1) <= plan.tolerance else 0
        change = min(max(wanted**_PROMPT, 1 / plan.most_change), plan.most_change)
        # Use only the newest measurement: earlier measurements belong to other settings of the drive.
        if in_a_row == 0:
            loop.change(frequency_hz, loop.bounded_vpp(change * loop.setting.setting_vpp))
        else:
            loop.forget()


def response_of(loop: SineLoop, plan: HeldResponse) -> tuple[float, float, float]:
    """Return response [m], ratio m0 / base and base acceleration [m/s2] from the newer half of periods."""
    periods, frequency_hz = loop.periods, loop.setting.frequency_hz
    newer = slice(periods.count // 2, None)
    base, response = periods.base[newer], periods.response[newer, 1]
    acceleration = abs(complex(np.mean(base)))
    ratio = loop.channels.transmissibility(base, response, frequency_hz)
    against = 1.0 if plan.response_of is PhaseReference.RELATIVE else 0.0
    response_m = abs(ratio - against) * acceleration / (2 * pi * frequency_hz) ** 2
    return response_m, abs(ratio), acceleration


def _record(loop: SineLoop, plan: HeldResponse, frequency_hz: float, direction: str) -> Controller[None]:
    loop.forget()
    yield from loop.listen(RunState.RECORDING, plan.record_s, plan.segment(frequency_hz, direction))
    response_m, ratio, _ = response_of(loop, plan)
    base = measured_level(loop.periods.base)
    is_held = abs(response_m / plan.response_m - 1) <= 2 * plan.tolerance
    loop.note(
        HeldResponseNote(
            frequency_hz=frequency_hz,
            response_m=response_m,
            response_ii=ratio,
            base_m_per_s2=base.amplitude,
            base_u=base.uncertainty,
            setting_vpp=loop.setting.setting_vpp,
            level=Hold.WITHIN if is_held else Hold.OUTSIDE,
        )
    )
