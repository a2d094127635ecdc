"""Wait until a motion has settled, while feedback brings the base to its level and holds it there."""

from dataclasses import dataclass
from math import ceil, isfinite

from ..excitation.dwell import HeldDwell
from ..excitation.plan import BaseLevel, Settling
from ..excitation.sine_sweep import HeldSweep
from ..excitation.steps import Segment
from ..plan import LOOK_PERIODS, RunState, look_s
from ..recording import (
    DwellNote,
    ExcursionNote,
    Hold,
    LevelNote,
    SegmentLabel,
    SegmentNote,
    SettledNote,
    Steadiness,
    SweepNote,
)
from .control_action import Controller, MeasuredLevel, measured_level
from .sine_loop import GainEstimator, SineLoop, start, track, update_track
from .steadiness import ORDERS, Judgement, Phasors, in_drives, judgement_of


@dataclass(frozen=True)
class SettledPoint:
    """Settled motion at one frequency, with its Response II (transmissibility)."""

    frequency_hz: float
    response: float
    period: int = 1
    """Number of drive periods after which the motion repeats; 0 if the motion does not repeat."""


_SURE = 2.0
_SAME_LEVEL = 0.004
"""Relative tolerance on the base level if a single order of the response determines settling."""
_PROMPT = 0.7
"""Exponent below 1 that reduces a correction while the specimen still responds to the last correction."""


@dataclass(frozen=True)
class SettledState:
    """State of the motion at one frequency, at the end of the wait for settling."""

    frequency_hz: float
    """Commanded drive frequency, by the generator's clock [Hz]."""
    drive_hz: float
    """Drive frequency, measured by the converter's clock [Hz]."""
    setting_vpp: float
    waited_s: float
    judgement: Judgement
    base: MeasuredLevel
    """Acceleration amplitude of the base's fundamental [m/s2]."""
    held: Hold
    harmonics: tuple[complex, ...]
    """Ratio of m0's displacement at 1 to 4 times its repetition rate to the base's at ``drive_hz``."""
    drives: int = 1
    """Number of drive periods in one period of m0."""

    @property
    def transmissibility(self) -> complex:
        """Ratio of the displacements of m0 and base at the drive frequency."""
        return self.harmonics[self.drives - 1]

    @property
    def response(self) -> float:
        """Response II: the magnitude of the transmissibility from base to m0."""
        return abs(self.transmissibility)

    @property
    def point(self) -> SettledPoint:
        """The values that a search for a jump compares: frequency, response and period."""
        return SettledPoint(self.frequency_hz, self.response, self.judgement.period)

    @property
    def note(self) -> SettledNote:
        """Note on this result; the numbers in the note are also stored with the segment."""
        found = self.judgement
        return SettledNote(
            frequency_hz=self.frequency_hz,
            motion=found.steadiness,
            period=found.period,
            waited_s=round(self.waited_s, 3),
            # With too few periods, the scatter is unknown: set it to the size of the motion.
            scatter=found.scatter if isfinite(found.scatter) else 1.0,
            noise=found.noise if isfinite(found.noise) else 0.0,
            setting_vpp=self.setting_vpp,
            base_m_per_s2=self.base.amplitude,
            base_u=self.base.uncertainty,
            level=self.held,
        )


@dataclass(frozen=True)
class SettlingController:
    """Wait until the motion at one frequency has settled, or until the longest allowed wait is over."""

    loop: SineLoop
    rule: Settling
    level: BaseLevel | None

    def settle(self) -> Controller[SettledState]:
        """Wait until the motion has settled, correct the level meanwhile, and return the result."""
        waited_s = 0.0
        while True:
            stretch_s = look_s(self.loop.motion_hz)
            yield from self.loop.listen(RunState.SETTLING, stretch_s)
            waited_s += stretch_s
            is_late = waited_s + stretch_s > self.rule.longest_wait_s
            if waited_s < self.rule.shortest_wait_s and not is_late:
                continue
            if not is_late and self._correct_level():
                continue
            found = self.settled_state(waited_s)
            if is_late or (self._is_steady(found) and found.judgement.steadiness is not Steadiness.UNSETTLED):
                self.loop.note(found.note)
                return found

    def mean_level(self) -> MeasuredLevel:
        """Return the base level [m/s2], from the newer half of the periods since the drive changed."""
        periods = self.loop.periods
        return measured_level(periods.base[periods.count // 2 :])

    def prompt_vpp(self, measured: MeasuredLevel) -> float:
        """Return the next generator setting [Vpp] for the base level; treat ``measured`` as exact."""
        assert self.level is not None
        now_vpp = self.loop.setting.setting_vpp
        certain = MeasuredLevel(measured.amplitude, 0.0)
        next_vpp = self.loop.bounded_vpp(now_vpp * certain.correction(self.level, self._target))
        return float(now_vpp * (next_vpp / now_vpp) ** _PROMPT)

    def hold_state(self, measured: MeasuredLevel) -> Hold:
        """Return whether a measured base level is within its tolerance."""
        if self.level is None:
            return Hold.OPEN
        return measured.hold_state(self._target, self.level.tolerance)

    @property
    def _target(self) -> float:
        """Target acceleration of the base at this frequency [m/s2]."""
        assert self.level is not None
        return self.level.acceleration_at(self.loop.setting.frequency_hz)

    def _correct_level(self) -> bool:
        if self.level is None or self.loop.periods.count < LOOK_PERIODS:
            return False
        now = self.loop.setting
        measured = self.mean_level()
        self.loop.require_answer(measured.amplitude)
        level = self.level
        if self.loop.settling_order is not None:
            # The phase of a single order depends on the level: compare only periods of equal level.
            level = level.model_copy(update={"tolerance": min(level.tolerance, _SAME_LEVEL)})
        next_vpp = self.loop.bounded_vpp(now.setting_vpp * measured.correction(level, self._target))
        if next_vpp == now.setting_vpp:
            return False
        self.loop.change(now.frequency_hz, next_vpp)
        return True

    def settled_state(self, waited_s: float) -> SettledState:
        """Return the state of the motion, from the periods since the last change of the drive."""
        loop, periods = self.loop, self.loop.periods
        # A motion that is judged by a single order settles slowly, so use only the newest periods.
        newest = periods.last(
            max(self.rule.periods, periods.count // 2) if loop.settling_order is None else self.rule.periods
        )
        measured = measured_level(newest.base)
        return SettledState(
            frequency_hz=loop.setting.frequency_hz,
            drive_hz=loop.drive_hz,
            setting_vpp=loop.setting.setting_vpp,
            waited_s=waited_s,
            judgement=self._judgement(periods.response),
            base=measured,
            held=self.hold_state(measured),
            harmonics=tuple(
                loop.channels.transmissibility(
                    newest.base, newest.response[:, order], loop.drive_hz, order / loop.drives
                )
                for order in range(1, ORDERS)
            ),
            drives=loop.drives,
        )

    def _judgement(self, points: Phasors) -> Judgement:
        order, noise = self.loop.settling_order, self.loop.noise
        found = judgement_of(points if order is None else points[:, order : order + 1], self.rule, noise)
        newest = points[-self.rule.periods :]
        return in_drives(found, newest, self.loop.drives, noise) if len(newest) else found

    def _is_steady(self, found: SettledState) -> bool:
        """Return whether the base level is accurately known, and in tolerance or limited by ``most_vpp``."""
        if self.level is None:
            return True
        is_known = _SURE * found.base.uncertainty <= self.level.tolerance * self._target
        is_at_the_end = found.setting_vpp >= self.loop.most_vpp
        return is_known and (found.held is Hold.WITHIN or is_at_the_end)


def hold_dwell(loop: SineLoop, plan: HeldDwell) -> Controller[None]:
    """Ramp up to the level, wait for settling, record, and ramp down."""
    controller = SettlingController(loop, plan.settling, plan.base_level)
    yield from start(loop, plan.frequency_hz, plan.base_level)
    yield from controller.settle()
    target = plan.base_level.acceleration_at(plan.frequency_hz)
    pieces = ceil(plan.duration_s / plan.update_s * (1 - 1e-9))
    outside = 0
    loop.forget()
    for number in range(pieces):
        begun_s = number * plan.update_s
        piece_s = min(plan.update_s, plan.duration_s - begun_s)
        yield from loop.listen(RunState.RECORDING, piece_s, plan.segment)
        measured = measured_level(loop.periods.base)
        loop.require_answer(measured.amplitude)
        held = controller.hold_state(measured)
        outside += held is Hold.OUTSIDE
        loop.note(
            LevelNote(
                at_s=begun_s + piece_s,
                base_m_per_s2=measured.amplitude,
                base_u=measured.uncertainty,
                setting_vpp=loop.setting.setting_vpp,
                level=held,
            )
        )
        # Chaos needs a long average, so average over all pieces since the last change of the drive.
        next_vpp = loop.bounded_vpp(loop.setting.setting_vpp * measured.correction(plan.base_level, target))
        if next_vpp != loop.setting.setting_vpp and number + 1 < pieces:
            loop.change(plan.frequency_hz, next_vpp)
    loop.note(DwellNote(segment=SegmentLabel.DWELL, looks=pieces, looks_outside=outside))
    yield from loop.ramp_down()


def record_settled(
    controller: SettlingController, found: SettledState, segment: Segment, duration_s: float
) -> Controller[None]:
    """Record a settled motion as a segment, and write a note on the motion."""
    controller.loop.forget()
    yield from controller.loop.listen(RunState.RECORDING, duration_s, segment)
    _note(controller, found, segment)


def record_and_judge(
    controller: SettlingController, segment: Segment, duration_s: float, waited_s: float
) -> Controller[SettledState]:
    """Record a motion long enough to decide whether it has settled; return its state."""
    shortest_s = (controller.rule.periods + 2) / controller.loop.motion_hz
    duration_s = max(duration_s, shortest_s)
    controller.loop.forget()
    yield from controller.loop.listen(RunState.RECORDING, duration_s, segment)
    found = controller.settled_state(waited_s)
    _note(controller, found, segment)
    return found


def _note(controller: SettlingController, found: SettledState, segment: Segment) -> None:
    loop = controller.loop
    measured = measured_level(loop.periods.base)
    loop.note(
        SegmentNote(
            segment=segment.label,
            frequency_hz=found.frequency_hz,
            drive_hz=loop.drive_hz,
            base_m_per_s2=measured.amplitude,
            base_u=measured.uncertainty,
            level=controller.hold_state(measured),
            response_ii=found.response,
            motion=found.judgement.steadiness,
            period=found.judgement.period,
        )
    )


def hold_sweep(loop: SineLoop, plan: HeldSweep) -> Controller[None]:
    """Ramp up to the level, wait for settling, sweep, and ramp down."""
    level = plan.base_level
    yield from start(loop, plan.start_hz, level)
    yield from SettlingController(loop, plan.settling, level).settle()
    estimator = GainEstimator(plan.average_s)
    excursion: ExcursionNote | None = None
    steps = outside = 0
    for mean_hz, duration_s in plan.mean_steps():
        track(loop, mean_hz, level, estimator, duration_s)
        yield from loop.listen(RunState.RECORDING, duration_s, plan.segment)
        update_track(loop, level, estimator)
        excursion = _excursion(loop, excursion, mean_hz, estimator.level - 1, level.tolerance)
        steps += 1
        outside += excursion is not None
    if excursion is not None:
        loop.note(excursion)
    loop.note(
        SweepNote(segment=SegmentLabel.SWEEP, steps=steps, steps_outside=outside, average_s=plan.average_s)
    )
    yield from loop.ramp_down()


def _excursion(
    loop: SineLoop, before: ExcursionNote | None, frequency_hz: float, deviation: float, tolerance: float
) -> ExcursionNote | None:
    """Extend the range of frequencies at which the level is out of tolerance; None if it is in tolerance."""
    if abs(deviation) <= tolerance:
        if before is not None:
            loop.note(before)
        return None
    begin_hz, worst = (frequency_hz, deviation) if before is None else (before.from_hz, before.worst)
    return ExcursionNote(
        from_hz=begin_hz, to_hz=frequency_hz, worst=max(worst, deviation, key=abs), level=Hold.OUTSIDE
    )
