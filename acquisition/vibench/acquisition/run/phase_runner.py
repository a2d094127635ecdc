"""Play phases while every block is read, recorded and checked against the limits."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from enum import Enum, auto
from typing import NoReturn, TypeAlias

import numpy as np

from ..errors import AcquisitionError, DriveLate, RunStalled
from ..excitation.steps import Play, Tone
from ..instruments import Block, Samples, Sweep
from ..plan import Phase, RunState
from ..recording import HOLD_ROOM_S, EventKind
from ..rig import Channel, Role
from ..stopping.stop import Cause, StopLevel, StopRequest, StopSwitch
from .acquisition_loop import BLOCK_S, AcquisitionLoop
from .drive import Drive
from .ending import Progress
from .limit_monitor import LimitMonitor
from .silence_watch import LISTEN_S, LONGEST_S, LOWER_AFTER_S, SilenceWatch
from .until import UntilWatch

DELAY_SAMPLES = 40
"""Approximate delay of a delta-sigma converter's filter in samples (NI 9234: 38.4). While the frequency
changes, this delay shifts the count of cycles."""


CLEAR = 0.3
"""Fraction of the amplitude above which a sample counts as clearly positive or negative."""


class GlideWatch:
    """Counter of the recorded drive's cycles in a stepped sweep, for comparison with the plan."""

    def __init__(self, channels: tuple[Channel, ...], sample_rate_hz: float) -> None:
        self._row = [channel.role for channel in channels].index(Role.DRIVE_VOLTAGE)
        self.sample_rate_hz = sample_rate_hz
        self.begin()

    def begin(self) -> None:
        """Reset the count for another sweep."""
        self._first: tuple[float, float] | None = None
        """Planned cycles at the first upward zero crossing, and the frequency there [Hz]."""
        self._last_hz = 0.0
        self._next_sample = -1
        self._planned = 0.0
        self._due_s = 0.0
        self._edges = 0
        self._more = 0.0
        self._offset_v = 0.0
        self._before: tuple[float, float] | None = None
        """Time and voltage of the last sample that was clearly positive or clearly negative."""

    def take(
        self,
        blocks: Sequence[Block],
        frequency_hz: float,
        duration_s: float,
        course: Callable[[float], float] | None = None,
    ) -> None:
        """Add the recorded ``blocks`` of one step of the sweep.

        If the frequency changes within the step, ``course`` returns the planned cycles since the step began.
        """
        if not blocks:
            return
        if blocks[0].first_sample != self._next_sample:
            self.begin()
            self._due_s = blocks[0].first_sample / self.sample_rate_hz
        self._next_sample = blocks[-1].first_sample + blocks[-1].volts.shape[1]
        for block in blocks:
            for edge_s in self._rises(block, frequency_hz):
                since_s = edge_s - self._due_s
                planned = self._planned + (frequency_hz * since_s if course is None else course(since_s))
                if self._first is None:
                    self._first = planned, frequency_hz
                self._edges += 1
                self._more = self._edges - 1 - (planned - self._first[0])
        self._planned += frequency_hz * duration_s
        self._due_s += duration_s
        self._last_hz = frequency_hz

    def _rises(self, block: Block, frequency_hz: float) -> Samples:
        """Return the times at which the drive rises through zero [s]; noise around zero is ignored."""
        volts, rate_hz = block.volts[self._row], self.sample_rate_hz
        low, high = float(volts.min()), float(volts.max())
        if volts.size * frequency_hz >= rate_hz:
            self._offset_v = 0.5 * (low + high)
        clear = np.flatnonzero(np.abs(volts - self._offset_v) > CLEAR * 0.5 * (high - low))
        before_s, before_v = self._before or (0.0, np.nan)
        time_s = np.append(before_s, (block.first_sample + clear) / rate_hz)
        v = np.append(before_v, volts[clear] - self._offset_v)
        self._before = float(time_s[-1]), float(v[-1])
        at = np.flatnonzero((v[:-1] < 0) & (v[1:] > 0))
        return np.asarray(time_s[at] - v[at] * (time_s[at + 1] - time_s[at]) / (v[at + 1] - v[at]))

    def following(self, sweep: Sweep) -> "Sink":
        """Return a function that compares a sweep made by the generator with the plan, block by block."""
        began_s = 0.0

        def take_block(block: Block) -> None:
            nonlocal began_s
            since_s, duration_s = began_s, block.volts.shape[1] / self.sample_rate_hz
            began, began_s = sweep.cycles(since_s), since_s + duration_s
            mean_hz = (sweep.cycles(began_s) - began) / duration_s
            self.take([block], mean_hz, duration_s, lambda t: sweep.cycles(since_s + t) - began)

        return take_block

    @property
    def more_cycles(self) -> float:
        """Number of cycles of the drive beyond the plan; 0 if the converter's delay can explain them."""
        if self._first is None:
            return 0.0
        delayed = DELAY_SAMPLES / self.sample_rate_hz * abs(self._last_hz - self._first[1])
        return float(np.sign(self._more) * max(0.0, abs(self._more) - delayed))


Sink: TypeAlias = Callable[[Block], None]
"""Function called with every block that is read."""

HOLD_LONGEST_S = HOLD_ROOM_S
"""Longest total hold of a run [s], limited by the space in its recording."""


LATEST = 0.5
"""Delay above which a stepped sweep's command is logged as late, as a fraction of the step."""
LATE_STEPS = 4
LATE_FOR_S = 2.0
"""Duration of consecutive late steps above which the run fails [s]."""
LEARNT = 0.05
"""Later commands are sent earlier by at least this fraction of a measured delay; by more in first steps."""
LONGEST_LEAD = 0.25
"""Largest time by which a command is sent early, as a fraction of the step."""
TOLD_CYCLES = 0.1
"""Deviation of the drive at the end of a sweep above which an event is logged [cycles]."""
MOST_MADE_UP = 3.0
"""Largest frequency correction for lost cycles, as a multiple of the planned frequency step."""
LEAST_LEFT = 0.2
"""Shortest time for a correction, relative to the step; also the largest relative frequency correction."""
_RAMPS = frozenset({RunState.RAMPING_UP, RunState.RAMPING_DOWN})


class _Pace(Enum):
    """Instant from which the times of a phase and its parts are counted."""

    AFTER_THE_COMMAND = auto()
    """The end of the phase's first command; used for settling."""
    OF_THE_COMMANDS = auto()
    """The planned time, or the end of the last command if this is later; used for ramps."""
    OF_THE_PLAN = auto()
    """The planned time; used for stepped sweeps."""
    OF_ITSELF = auto()
    """The end of the previous phase; used if no command is due, or if commands take no time."""


class StopRequested(Exception):
    """Raised when somebody has requested the end of the run."""

    def __init__(self, request: StopRequest) -> None:
        super().__init__(request.reason)
        self.request = request


@dataclass(eq=False)
class PhaseRunner:
    """The sampling part of a run: phases, holds, and the ramp at an early end.

    After every block the limits and the stop switch are checked. If the run must end, LimitExceeded,
    RunStalled or `StopRequested` is raised, and the run ramps down.
    """

    drive: Drive
    loop: AcquisitionLoop
    limit_monitor: LimitMonitor
    silence: SilenceWatch
    glide: GlideWatch
    switch: StopSwitch
    total_s: float
    until: UntilWatch | None

    def __post_init__(self) -> None:
        self.state = RunState.CHECKING
        self._look: Callable[[Block], None] = self._go_on
        self._held_s = 0.0
        self._play: Play | None = None
        self._lead_s = 0.0
        self._glides = 0
        self._late_steps = 0
        self._lost_cycles = 0.0
        self._glided_hz = self._planned_hz = 0.0

    def run_phase(self, phase: Phase, into: list[Block] | None = None) -> Iterator[Progress]:
        """Play a phase and yield progress; the blocks of the phase are also appended to ``into``, if given.

        A phase begins when its command has been carried out, however long the command takes. Steps of a sweep
        within one segment start at their planned times; the run fails if this is impossible.
        """
        self._enter(phase.state)
        pace, commanded = self._pace_of(phase), phase
        if pace is _Pace.OF_THE_PLAN:
            commanded = self._with_lost_cycles(phase, self._require_pace(phase))
        else:
            more, self._lost_cycles = self.glide.more_cycles, 0.0
            self.glide.begin()
            if abs(more) > TOLD_CYCLES:
                text = f"the recorded drive ended {more:+.2g} cycles off the planned phase"
                self.loop.log(EventKind.LATE, text)
            yield from self._read(0.0)
            self._glided_hz = phase.play.frequency_hz if isinstance(phase.play, Tone) else 0.0
            self._planned_hz = self._glided_hz
        if isinstance(phase.play, Sweep) and phase.state is RunState.RECORDING:
            yield from self._catch_up()  # so that the segment starts at the trigger
        if phase.segment != self.loop.segment:
            self.loop.enter(None)  # no segment includes the duration of the next command
        waits = self.drive.perform(commanded)
        wait_s = next(waits, None)
        if pace is _Pace.AFTER_THE_COMMAND:
            yield from self._catch_up()
        self.loop.enter(phase.segment)
        self._play = phase.play
        # A phase of a recorded sweep is compared with the plan; the blocks of other phases are not stored.
        may_glide = self.drive.is_commanded and phase.state is RunState.RECORDING
        blocks = [] if into is None else into
        heard = None if into is None and not may_glide else blocks.append
        if into is None and may_glide and isinstance(phase.play, Sweep):
            heard = self.glide.following(phase.play)
        while wait_s is not None:
            yield from self._read(wait_s, heard, self._lead_s if phase.state is RunState.RECORDING else 0.0)
            if pace is _Pace.OF_THE_COMMANDS:
                yield from self._catch_up(None if into is None else into.append)
            wait_s = next(waits, None)
        if may_glide and isinstance(phase.play, Tone):
            self.glide.take(blocks, phase.play.frequency_hz, phase.duration_s)

    def _pace_of(self, phase: Phase) -> "_Pace":
        if not self.drive.is_commanded:
            return _Pace.OF_ITSELF
        if phase.state in _RAMPS:
            return _Pace.OF_THE_COMMANDS
        if phase.play == self._play:
            return _Pace.OF_ITSELF
        if phase.state is RunState.RECORDING and phase.segment == self.loop.segment:
            return _Pace.OF_THE_PLAN
        return _Pace.AFTER_THE_COMMAND

    def _with_lost_cycles(self, phase: Phase, late_s: float) -> Phase:
        """Return the phase with its frequency corrected for cycles that were lost before this phase.

        While a command is late, the previous tone continues. The lost cycles are the difference of the two
        frequencies times the delay. Cycles that one step cannot correct are corrected in the next step.
        """
        if not isinstance(phase.play, Tone):
            return phase
        planned_hz, left_s = phase.play.frequency_hz, phase.duration_s - late_s
        self._lost_cycles += (planned_hz - self._glided_hz) * late_s
        # Limit the correction by the planned frequency step, so that corrections do not accumulate.
        most_hz = min(MOST_MADE_UP * abs(planned_hz - self._planned_hz), LEAST_LEFT * planned_hz)
        wanted_hz = self._lost_cycles / max(left_s, LEAST_LEFT * phase.duration_s)
        more_hz = min(max(wanted_hz, -most_hz), most_hz) if left_s > 0 else 0.0
        self._lost_cycles -= more_hz * left_s
        self._planned_hz, self._glided_hz = planned_hz, planned_hz + more_hz
        return replace(phase, play=replace(phase.play, frequency_hz=self._glided_hz))

    def _require_pace(self, phase: Phase) -> float:
        """Return the delay of this command [s], and send later commands earlier accordingly.

        Delays above half a step are logged; several such delays in a row raise DriveLate.

        Samples arrive some milliseconds after conversion, so a command that waits for samples is late. Over a
        sweep of 200 Hz, one or two cycles would be lost, so later commands are sent earlier.
        """
        late_s = self.loop.waiting_s - self._lead_s
        self._glides += 1
        learnt_s = self._lead_s + max(1 / self._glides, LEARNT) * late_s
        self._lead_s = min(max(0.0, learnt_s), LONGEST_LEAD * phase.duration_s)
        if late_s <= LATEST * phase.duration_s:
            self._late_steps = 0
            return late_s
        self._late_steps += 1
        at = f"{phase.play.frequency_hz:.6g} Hz" if isinstance(phase.play, Tone) else "one of its steps"
        text = (
            f"the drive was {late_s:.3g} s behind the plan at {at}, where a step lasts {phase.duration_s:g} s"
        )
        self.loop.log(EventKind.LATE, text)
        late_for_s = late_s + self._late_steps * phase.duration_s
        if self._late_steps >= LATE_STEPS and late_for_s > LATE_FOR_S:
            raise DriveLate(
                f"{text}, {self._late_steps} times in a row. The run was ended, and its recording was kept; "
                "give a longer step_s, or shorten generator.settle_s if the instrument allows it"
            )
        return late_s

    def _catch_up(self, into: Sink | None = None) -> Iterator[Progress]:
        return self._record(self.loop.waiting_sizes(), into)

    def _record(self, sizes: Iterable[int], into: Sink | None = None) -> Iterator[Progress]:
        """Read and record a block of each size; check the limits after each block, and hold if requested."""
        for size in sizes:
            block = self.loop.read(size)
            if into is not None:
                into(block)
            yield self._report_progress(block)
            self._look(block)
            if self.switch.is_holding and self._look == self._go_on and self.state is not RunState.HELD:
                yield from self._hold()

    def ramp_down_early(
        self, reason: str, level: StopLevel, ramp_s: Callable[[StopLevel], float]
    ) -> Iterator[Progress]:
        """Ramp down from the current state without limit checks; an open segment stays incomplete.

        A faster stop, if requested, takes over. ``ramp_s`` returns the duration of the ramp for a stop
        level [s]. The method records until silence is measured; raises InstrumentError if the drive stays on.
        """
        self._look = self.silence.take
        self.loop.log(EventKind.END, reason)
        self.silence.begin(self.loop.samples)
        if self.drive.is_playing:
            self._enter(RunState.RAMPING_DOWN)
        if level is StopLevel.OFF:
            self.drive.cut()  # switch off before reading, because the converter may not answer
        self.loop.cut()
        while level is not StopLevel.OFF and self.drive.is_playing:
            for wait_s in self.drive.ramp_down(ramp_s(level), self.loop.time_s):
                yield from self._record(self.loop.sizes_until(wait_s))
                if (harder := self.switch.harder_than(level)) is not None:
                    level = harder.level
                    self.loop.log(EventKind.END, harder.reason)
                    break
        self.drive.cut()
        self.loop.log(EventKind.OFF, "output switched off")
        yield from self._listen()
        self.loop.log(EventKind.SILENCE, f"{level.value}: {self.silence.text()}")
        self.silence.require_silence()

    def _listen(self) -> Iterator[Progress]:
        """Continue to record until the measured drive is silent, but no longer than `LONGEST_S`.

        While a drive is measured, switch the output off again and lower the amplitude, at growing intervals.
        """
        give_up_s, wait_s = self.loop.elapsed_s + LONGEST_S, LOWER_AFTER_S
        yield from self._read(LISTEN_S)
        if not self.silence.is_silent:
            self.loop.cut()
            yield from self._read(LISTEN_S)  # the first samples may be from before the output was off
        lower_s = self.loop.elapsed_s + wait_s
        while not self.silence.is_silent and self.loop.elapsed_s < give_up_s:
            if self.loop.elapsed_s > lower_s:
                self.silence.note_signal()
                with suppress(AcquisitionError):  # the measured drive shows whether this succeeded
                    self.drive.silence()
                self.loop.log(EventKind.OFF, "the output was switched off again, and its amplitude lowered")
                self.loop.cut()
                lower_s, wait_s = lower_s + 2 * wait_s, 2 * wait_s
            yield from self._read(LISTEN_S)

    def _read(self, duration_s: float, into: Sink | None = None, lead_s: float = 0.0) -> Iterator[Progress]:
        return self._record(self.loop.sizes_for(duration_s, lead_s), into)

    def _hold(self) -> Iterator[Progress]:
        """Hold the run, monitored and recorded, until it is resumed or stopped.

        Signals that must be fed with samples cannot be held. The recording has space for a hold of
        `HOLD_LONGEST_S`; after this time, the run is ramped down.
        """
        if refusal := self.refusal_to_hold():
            self._stop_hold(f"{refusal}: the run was ramped down")
        before = self.state
        self._enter(RunState.HELD)
        while self.switch.is_holding:
            self._held_s += BLOCK_S
            if self._held_s > HOLD_LONGEST_S:
                self._stop_hold(f"held for {HOLD_LONGEST_S:g} s, the longest hold that fits in the recording")
            yield from self._record([self.loop.extend(BLOCK_S)])
        self._enter(before)

    def refusal_to_hold(self) -> str:
        """Return the reason why the drive cannot be held now; empty if the drive can be held."""
        source = self.drive.drive_source.value
        return "" if self.drive.can_hold else f"the present signal of the {source} cannot be held"

    def _stop_hold(self, reason: str) -> NoReturn:
        """Stop the run, and thus the campaign, because a hold is impossible."""
        request = StopRequest.of(Cause.OPERATOR, reason)
        self.switch.ask(request)
        raise StopRequested(request)

    def _go_on(self, block: Block) -> None:
        """Raise an exception if the run must end early because of a limit, a stall, or a request."""
        self.limit_monitor.require_safe(block)
        if (request := self.switch.request) is not None:
            raise RunStalled(request.reason) if request.cause is Cause.FAULT else StopRequested(request)

    def _report_progress(self, block: Block) -> Progress:
        """Write requested events to the recording, and return the progress."""
        loop = self.loop
        for text in self.switch.take_marks():
            loop.log(EventKind.MARK, text)
        for text in self.switch.take_changes():
            loop.log(EventKind.SPECIMEN, text)
            self.limit_monitor.note_change(text, loop.samples)
        level_vpp = self.drive.setting_vpp
        frequency_hz = self._play.frequency_hz if isinstance(self._play, Tone) else None
        until = None if self.until is None else self.until.progress
        return Progress(
            self.state, loop.segment, block, loop.elapsed_s, self.total_s, level_vpp, frequency_hz, until
        )

    def _enter(self, state: RunState) -> None:
        if state is not self.state:
            self.state = state
            self.loop.log(EventKind.STATE, state.value)
