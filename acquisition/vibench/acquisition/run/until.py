"""End a recording when its results are accurate enough; another process analyses the growing file."""

import json
import subprocess
import sys
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from time import monotonic

from ..errors import AcquisitionError
from ..excitation.steps import Waveform
from ..host.beside import Beside, ClosedOnLeaving
from ..plan import (
    FEWEST_REALISATIONS,
    LOOK_FACTOR,
    Measurement,
    Phase,
    RunState,
    Until,
    phases,
)
from ..recording import UntilNote
from ..stopping.stop import StopSwitch

PIECE_S = 0.5
"""Interval at which to decide whether to continue [s]; realisations of noise are always completed."""
LONGEST_HINDRANCE = 120
"""Largest length of the text that states why a bound is missing [characters]."""
_ENDING_S = 2.0
_READY_S = 60.0
"""Longest wait for the analysis to start [s]; after this time, the run starts anyway."""
_ASK_S = 0.05


class UntilWatch(ClosedOnLeaving):
    """Repeated analysis of a growing recording, until the error bounds are small enough.

    A stretch is a part of the recording with one result. The process starts before any drive. The run queues
    requests, reads results and never waits. If the process fails, the recording lasts its longest time.
    """

    def __init__(self, measurement: Measurement, until: Until, path: Path) -> None:
        self._until = until
        self._path = path
        self._beside = Beside("until")
        try:
            self._process = subprocess.Popen(
                [sys.executable, "-m", "vibench.analysis.results.growing_bounds"],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                text=True,
                # Ctrl-C in a terminal is handled by the program that runs the measurement.
                start_new_session=True,
            )
        except OSError as error:
            raise AcquisitionError(
                f"{measurement.name} uses 'until', but its analysis could not be started ({error}). "
                "Nothing was played; close other programs, or leave 'until' out"
            ) from error
        excitation = measurement.excitation
        self._labels = excitation.result_labels
        steps = [each.record_s for each in excitation.steps()]
        self._longest_s = sum(steps) if excitation.stretches > 1 else max(steps)
        self._greeting: list[str] = []
        self._stretch = 0
        self._recorded_s = self._due_s = 0.0
        self._begun: UntilNote | None = None
        """Note of the current stretch (step or dwell) before its first analysis."""
        self._found: UntilNote | None = None
        """Note of the last analysis, possibly of the previous stretch; the thread replaces it atomically."""
        self.ended: list[UntilNote] = []
        """Final notes of stretches, which the run writes to the recording."""

    @property
    def progress(self) -> UntilNote | None:
        """Newest note of the current stretch (step or dwell); None between stretches."""
        begun, found = self._begun, self._found
        is_newer = begun is not None and found is not None and found.stretch == begun.stretch
        return found if is_newer else begun

    def wait_until_ready(self, switch: StopSwitch) -> None:
        """Wait until the process is ready or a stop is requested, before any signal is played."""
        give_up_s = monotonic() + _READY_S
        self._beside.do(lambda: self._greeting.append(self._read_answer()))
        while self._beside.is_busy and switch.request is None and monotonic() < give_up_s:
            self._beside.wait(_ASK_S)

    def phases(self, measurement: Measurement) -> Iterator[Phase]:
        """Yield the phases of the measurement; recording phases end early if bounds are small enough."""
        for phase in phases(measurement):
            is_result = phase.segment is not None and phase.segment.label in self._labels
            if not isinstance(phase.play, Waveform):
                if is_result:
                    yield from self._pieces(phase)
                else:
                    yield phase
                continue
            # For periodic noise, all realisations together give one result. Each realisation has two ramps.
            if self._is_reached and phase.state is RunState.RAMPING_UP:
                break
            if not (self._is_reached and phase.state in (RunState.SETTLING, RunState.RECORDING)):
                if is_result and self._begun is None:
                    self._begin(FEWEST_REALISATIONS * phase.duration_s)
                yield phase
                if is_result:
                    self._count_time(phase.duration_s)
        self._end()

    def _pieces(self, phase: Phase) -> Iterator[Phase]:
        self._end()
        self._longest_s = phase.duration_s
        self._begin(min(max(self._until.shortest_s, PIECE_S), phase.duration_s))
        left_s = phase.duration_s
        while left_s > 1e-9 and not self._is_reached:  # a smaller remainder is a rounding error
            piece_s = min(PIECE_S, left_s)
            yield Phase(phase.state, phase.play, piece_s, phase.segment)
            left_s -= piece_s
            self._count_time(piece_s)

    @property
    def _is_reached(self) -> bool:
        return self.progress is not None and self.progress.is_reached

    def _begin(self, first_s: float) -> None:
        self._stretch += 1
        self._recorded_s, self._due_s = 0.0, first_s
        wishes = self._until.required_bounds
        self._begun = UntilNote(wishes=wishes, longest_s=self._longest_s, stretch=self._stretch)

    def _end(self) -> None:
        if (progress := self.progress) is not None:
            self.ended.append(progress.model_copy(update={"recorded_s": self._recorded_s}))
            self._begun = None

    def _count_time(self, duration_s: float) -> None:
        """Count the recorded time, and request an analysis when one is due."""
        self._recorded_s += duration_s
        note, recorded_s = self.progress, self._recorded_s
        if note is None or note.is_reached or recorded_s < self._due_s * (1 - 1e-9) or self._beside.is_busy:
            return
        while self._due_s <= recorded_s * (1 + 1e-9):
            self._due_s *= LOOK_FACTOR
        self._beside.do(lambda: self._look(note, recorded_s))

    def _look(self, note: UntilNote, recorded_s: float) -> None:
        """Request the error bounds for the first ``recorded_s`` of the stretch, in the helper thread."""
        bounds: dict[str, float | None] = {}
        try:
            question = {"path": str(self._path), "stretch": note.stretch, "recorded_s": recorded_s}
            assert self._process.stdin is not None
            self._process.stdin.write(json.dumps(question) + "\n")
            self._process.stdin.flush()
            answer = json.loads(self._read_answer())
            bounds = {name: answer["bounds"].get(name) for name in note.wishes}
            hindrance = str(answer["hindrance"])
        except (OSError, ValueError, KeyError, AttributeError):
            hindrance = "the analysis during the run has ended"
        self._found = note.model_copy(
            update={
                "bounds": bounds,
                "looked_s": recorded_s,
                "looks": note.looks + 1,
                "hindrance": hindrance[:LONGEST_HINDRANCE],
            }
        )

    def _read_answer(self) -> str:
        assert self._process.stdout is not None
        return self._process.stdout.readline()

    def close(self) -> None:
        """End the analysis process and discard its results. May be called at any time."""
        self._process.kill()
        self._process.wait(_ENDING_S)
        self._beside.close(_ENDING_S)
        for pipe in (self._process.stdin, self._process.stdout):
            with suppress(OSError):  # a broken pipe: the process has ended
                assert pipe is not None
                pipe.close()
