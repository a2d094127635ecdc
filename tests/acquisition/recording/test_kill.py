"""A recording survives ``kill -9`` at any moment and loses at most the last second."""

import json
import os
import random
import signal
import subprocess
import sys
import threading
import time
from collections import Counter
from dataclasses import dataclass, field
from itertools import count
from pathlib import Path

import numpy as np
import pytest

from tests.acquisition.recording import recording_child as child
from vibench.acquisition import open_recording
from vibench.acquisition.recording import RecordingState, recover

CHILD = Path(__file__).with_name("recording_child.py")

PROMISE_S = 1.0
ENDLESS_BLOCKS = 200_000
"""Several times as many as the fastest disk writes before the kill."""
PACED_BLOCKS, BLOCKS_PER_S = 8000, 2000
"""Twenty times the speed of a real recording, for four seconds."""
FINISHED_BLOCKS = 1500
COMMIT_STEPS = 8
"""A commit has about four steps: a sync, the counter and a sync; there are two commits per second."""

forks = pytest.mark.skipif(not hasattr(os, "fork"), reason="Windows cannot fork")


@dataclass
class Killed:
    """A killed recording: its folder, when it was killed, and the samples handed over by then."""

    folder: Path
    phase: str
    killed_s: float
    acknowledged: list = field(default_factory=list)

    @property
    def part(self):
        return self.folder / "a.h5.part"

    @property
    def final(self):
        return self.folder / "a.h5"

    @property
    def safe_samples(self):
        """Number of samples that were handed over a second before the kill."""
        before_s = self.killed_s - PROMISE_S
        return max((samples for time_s, samples in self.acknowledged if time_s <= before_s), default=0)

    @property
    def sent_samples(self):
        return max((samples for _, samples in self.acknowledged), default=0) + 2 * child.BLOCK


class Victims:
    """Processes that record and are killed; they are forked from a process that has imported everything."""

    def __init__(self, folder):
        self._folder = folder
        self._number = count()
        self._server = subprocess.Popen(
            [sys.executable, str(CHILD)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
        self.finishing_s = self._finishing_s()

    def close(self):
        self._server.stdin.close()
        self._server.wait()
        self._server.stdout.close()

    def while_recording(self, chance):
        return self._kill_after("recording", 1, chance.uniform(0.0, 2.2), PACED_BLOCKS, BLOCKS_PER_S)

    def while_finalising(self, chance):
        delay_s = chance.uniform(0.0, self.finishing_s)
        return self._kill_after("finalising", FINISHED_BLOCKS + 1, delay_s, FINISHED_BLOCKS)

    def while_committing(self, chance):
        """Kill the process at a step of a commit: before a sync, or just after a counter was written."""
        folder, _ = self._begin(PACED_BLOCKS, BLOCKS_PER_S, chance.randint(1, COMMIT_STEPS))
        lines = list(iter(self._server.stdout.readline, "ended\n"))
        self._release()
        (said,) = (line for line in lines if line.startswith("committing"))
        return Killed(folder, "committing", float(said.split()[1]), _acknowledgements(lines))

    def _kill_after(self, phase, line_number, delay_s, blocks, blocks_per_s=None):
        """Kill ``delay_s`` after an output line; return None if the recording had finished by then."""
        folder, pid = self._begin(blocks, blocks_per_s)
        lines = [self._server.stdout.readline() for _ in range(line_number)]
        died_s = []

        def kill():
            died_s.append(time.monotonic())
            os.kill(pid, signal.SIGKILL)

        timer = threading.Timer(delay_s, kill)
        timer.start()
        for line in iter(self._server.stdout.readline, "ended\n"):
            lines.append(line)
            if line == "finished\n":
                timer.cancel()
        timer.join()
        self._release()
        has_finished = lines[-1] == "finished\n"
        return None if has_finished else Killed(folder, phase, died_s[0], _acknowledgements(lines))

    def _release(self):
        """Allow the ended process to be removed, so that its number can be reused."""
        self._server.stdin.write("\n")
        self._server.stdin.flush()

    def _begin(self, blocks, blocks_per_s=None, commit_step=None):
        folder = self._folder / str(next(self._number))
        folder.mkdir()
        order = {
            "path": str(folder / "a.h5"),
            "blocks": blocks,
            "commit_step": commit_step,
            "blocks_per_s": blocks_per_s,
        }
        self._server.stdin.write(json.dumps(order) + "\n")
        self._server.stdin.flush()
        lines = iter(self._server.stdout.readline, "")
        return folder, next(int(line.split()[1]) for line in lines if line.startswith("pid"))

    def _finishing_s(self):
        self._begin(FINISHED_BLOCKS)
        for line in iter(self._server.stdout.readline, "ended\n"):
            if line == "finishing\n":
                began_s = time.monotonic()
            elif line == "finished\n":
                taken_s = time.monotonic() - began_s
        self._release()
        return taken_s


def _acknowledgements(lines):
    pairs = [line.split() for line in lines if line[0].isdigit()]
    return [(float(time_s), int(samples)) for time_s, samples in pairs]


def require_truth(recording):
    for row, role in enumerate(recording.roles):
        np.testing.assert_array_equal(recording.read_counts(role), child.truth(0, recording.samples, row))


def require_intact(killed):
    """Open and recover a killed recording: every sample is true, and at most the last second is missing."""
    committed, state = None, RecordingState.COMPLETE
    if killed.part.exists():
        with open_recording(killed.part) as recording:
            committed, state = recording.samples, recording.state
            assert killed.safe_samples <= committed <= killed.sent_samples
            require_truth(recording)
        recover(killed.part)
    assert [each.name for each in killed.folder.iterdir()] == ["a.h5"]
    with open_recording(killed.final) as recording:
        assert recording.state is state
        assert committed in (None, recording.samples)
        assert recording.samples >= killed.safe_samples
        if state is RecordingState.INTERRUPTED:
            assert recording.events[-1].kind == "interrupted"
        else:
            assert recording.samples == FINISHED_BLOCKS * child.BLOCK
        require_truth(recording)
        assert recording.check_seal("whole").state.value == "intact"


def kill_in_phases(folder, moments, seed):
    """Kill recordings in each phase, as many as requested; count the files that were left behind."""
    left = Counter()
    victims = Victims(folder)
    try:
        for phase, wanted in moments.items():
            kill = getattr(victims, f"while_{phase}")
            for attempt in range(4 * wanted):
                killed = kill(random.Random(f"{seed} {phase} {attempt}"))
                if killed is None:
                    continue  # the kill came too late: the recording had finished
                names = frozenset(each.name.removeprefix("a.h5") or ".h5" for each in killed.folder.iterdir())
                left[phase, names] += 1
                require_intact(killed)
                killed.final.unlink()
                if sum(number for (each, _), number in left.items() if each == phase) == wanted:
                    break
    finally:
        victims.close()
    return left


def in_phase(left, phase):
    return sum(number for (each, _), number in left.items() if each == phase)


@pytest.mark.thorough
@forks
def test_recordings_killed_in_every_phase_lose_at_most_one_second(tmp_path):
    left = kill_in_phases(tmp_path, {"recording": 2, "committing": 3, "finalising": 3}, seed=1)
    assert [in_phase(left, phase) for phase in ("recording", "committing", "finalising")] == [2, 3, 3]


@pytest.mark.thorough
def test_a_killed_program_leaves_a_recording_that_opens(tmp_path):
    words = tmp_path / "words"
    with words.open("wb") as out:
        process = subprocess.Popen(
            [sys.executable, str(CHILD), str(tmp_path / "a.h5"), str(ENDLESS_BLOCKS)], stdout=out
        )
        while b"\n" not in words.read_bytes():
            assert process.poll() is None
        process.kill()
        process.wait()
    with open_recording(recover(tmp_path / "a.h5.part")) as recording:
        assert recording.state is RecordingState.INTERRUPTED
        require_truth(recording)
