"""Measure the time until the generator's output is silent, for each cause, state of a run and condition.

    python benchmarks/time_to_silence.py [--cells SHARE] [--seed N]
    python benchmarks/time_to_silence.py --tries 10000 --commands 200

This process runs the virtual rig in real time, and a witness that records when the generator's output was
last loud. The engine is a separate process, which reaches the rig as it reaches real instruments. A cell of
the table is one run. It is brought into a state, the condition is created, the cause happens, and the witness
waits for silence. Time counts from the cause, or from the engine's continuation if it was suspended.
``--cells 0.1`` measures a tenth of the cells, drawn with the seed. The second form counts how often a running
engine was not found, through the client and through the command. Linux only.
"""

import argparse
import os
import random
import resource
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from itertools import product
from pathlib import Path

import numpy as np

from vibench.acquisition import CheckRule, StopLevel
from vibench.acquisition.engine import (
    Attendant,
    CampaignRequest,
    EngineClient,
    EngineError,
    EngineProcess,
    EngineState,
    StopDelivery,
    start_engine,
    stop_engine,
    the_engine,
)
from vibench.acquisition.plan import Campaign
from vibench.acquisition.rig import KnobSheet, Rig, load_rig
from vibench.virtual_rig import VirtualRig

RIG = Path(__file__).parent.parent / "hardware_configs" / "virtual_rig.toml"
BUSY = "while True: sum(i * i for i in range(100_000))"
LOUD_V = 5e-3
"""Voltage above which the output counts as loud [V]; the dwell has 0.75 V."""
SILENT_FOR_S = 0.4
PATIENCE_S = 30.0
ATTEMPTS = 5
STALL_S = 1.0
RAMP_S = 0.5
ABORT_S = 0.067
BLOCK_S = 0.1
PLAN = {
    "name": "silence",
    "measurements": [
        {
            "name": "run",
            "ramp_s": RAMP_S,
            "ramp_step_s": 0.05,
            "excitation": {
                "kind": "dwell", "amplitude_vpp": 1.5, "frequency_hz": 260, "settle_s": 1.0, "duration_s": 120
            },
        }
    ],
}  # fmt: skip
STOP_INTO = {"held": StopLevel.HOLD, "ramping_down": StopLevel.RAMP}
"""States of a run that begin with a stop."""
STATES = ("checking", "ramping_up", "settling", "recording", "held", "ramping_down")


class Witness:
    """Observer of the generator's rendered output that records when it was last loud."""

    def __init__(self, virtual: VirtualRig) -> None:
        self._render = virtual.generator.render
        self.last_loud_s = -1.0
        self.last_look_s = 0.0
        virtual.generator.render = self._look  # type: ignore[method-assign]

    def _look(self, start_s: float, interval_s: float, count: int) -> np.ndarray:
        volts = self._render(start_s, interval_s, count)
        self.last_look_s = time.monotonic()
        if count and np.max(np.abs(volts)) > LOUD_V:
            self.last_loud_s = self.last_look_s
        return volts

    def silent_since_s(self) -> float:
        """Wait until the output has been silent for a while; return the time at which the silence began."""
        give_up_s = time.monotonic() + PATIENCE_S
        while self.last_look_s - self.last_loud_s < SILENT_FOR_S:
            if time.monotonic() > give_up_s:
                return float("inf")
            time.sleep(0.01)
        return self.last_loud_s


class WatchedRun:
    """A virtual rig with its witness, and the client of an engine that drives it."""

    client: EngineClient
    pid: int
    """Process id of the engine."""

    def __init__(self, virtual: VirtualRig, folder: Path, **of_generator: object) -> None:
        self.virtual = virtual
        self.witness = Witness(virtual)
        self.folder = folder
        generator = {"resource": virtual.socket_resource, **of_generator}
        self.served = virtual.rig.model_copy(
            update={
                "virtual": None,
                "daq": virtual.rig.daq.model_copy(update={"server": virtual.daq_address}),
                "generator": virtual.rig.generator.model_copy(update=generator),
            }
        )
        self.sheet = KnobSheet(operator="laboratory", confirmed=datetime.now(UTC), knobs=virtual.rig.knobs)

    def run_state(self) -> str:
        """Return the state of the run; empty without a run."""
        run = self.client.status().run
        return "" if run is None else run.run_state.value

    def is_in(self, state: str) -> bool:
        """Return whether the run is in a state and the output was loud within the last 0.1 s."""
        return self.run_state() == state and time.monotonic() - self.witness.last_loud_s < 0.1

    def stop_into(self, state: str) -> None:
        """Request the stop that leads to a state, if there is one, and wait for the state."""
        if state in STOP_INTO:
            self.client.stop(STOP_INTO[state])
        self.wait_until(lambda: self.run_state() == state, state)

    def wait_until(self, is_so: Callable[[], bool], what: str) -> None:
        """Wait for a condition; raise an exception if it takes too long."""
        raise NotImplementedError


class Laboratory(WatchedRun):
    """A rig under watch, and an engine that is started when needed."""

    def __init__(self, virtual: VirtualRig, folder: Path) -> None:
        super().__init__(virtual, folder)
        self.engine: EngineProcess | None = None
        self._number = 0
        self._attendant: Attendant | None = None

    @property
    def pid(self) -> int:
        """Process id of the engine."""
        assert self.engine is not None
        return self.engine.pid

    def ready(self) -> None:
        """Provide an engine with an open bench; start a new one if necessary."""
        if self.engine is not None and not self.engine.is_alive:
            self.close()
        if self.engine is None:
            self.engine = start_engine()
        if self._attendant is None:
            self._attendant = Attendant(self.engine.address)
            threading.Thread(target=self._attend, args=(self._attendant,), daemon=True).start()
        self.client = EngineClient.attach(self.engine.address)
        if self.client.status().state in (EngineState.CLOSED, EngineState.FAULT):
            self.client.open(self.served, self.sheet)
        self.wait_until(lambda: self.client.status().state is EngineState.READY, "an open bench")

    def run_into(self, state: str) -> None:
        """Start a recording and wait for a state; repeat, because a check may fail on a busy computer."""
        for _ in range(ATTEMPTS):
            self._begin()
            first = "recording" if state in STOP_INTO else state
            self.wait_until(lambda: self.has_ended() or self.is_in(first), first)  # noqa: B023
            if not self.has_ended():
                break
        self.stop_into(state)

    def has_ended(self) -> bool:
        """Return whether the run has ended."""
        return self.client.status().state is EngineState.READY

    def _begin(self) -> None:
        self._number += 1
        request = CampaignRequest(
            campaign=Campaign.model_validate(PLAN),
            folder=self.folder / str(self._number),
            check=CheckRule.WAIVED,
        )
        self.client.arm_request(request)
        self.client.start()

    def wait_until(self, is_so: Callable[[], bool], what: str) -> None:
        """Wait for a condition; exit with an error if it takes too long."""
        give_up_s = time.monotonic() + PATIENCE_S
        while not is_so():
            if time.monotonic() > give_up_s:
                raise SystemExit(f"no {what} within {PATIENCE_S:g} s: {self.client.status()}")
            time.sleep(0.005)

    def forget_viewer(self) -> None:
        """Stop attending the engine."""
        attendant, self._attendant = self._attendant, None
        if attendant is not None:
            attendant.close()

    def close(self) -> None:
        """End the engine."""
        self.forget_viewer()
        if self.engine is not None:
            self.engine.close()
            self.engine = None

    def _attend(self, attendant: Attendant) -> None:
        while self._attendant is attendant:
            attendant.live()
            time.sleep(0.05)


@dataclass(frozen=True)
class Cause:
    """Cause of a stop, and the time to silence that docs/safety.md states [s]."""

    happen: Callable[[Laboratory], None]
    within_s: float


def stop_by_command(level: StopLevel) -> Callable[[Laboratory], None]:
    """Return a function that stops the engine as the command does."""

    def stop(laboratory: Laboratory) -> None:
        assert stop_engine(the_engine(laboratory.pid), level, "measured") in StopDelivery

    return stop


def refuse_writing(laboratory: Laboratory) -> None:
    """Make every write of the engine to a file fail."""
    resource.prlimit(laboratory.pid, resource.RLIMIT_FSIZE, (0, resource.RLIM_INFINITY))


def lose_samples(laboratory: Laboratory) -> None:
    """Cause an overrun of the converter's buffer."""
    laboratory.virtual.faults.overrun()


MARGIN_S = 1.0
"""Margin for commands over the cable, the watchdog's interval, and a busy computer [s]."""
CAUSES = {
    "stop --level ramp": Cause(stop_by_command(StopLevel.RAMP), BLOCK_S + RAMP_S + MARGIN_S),
    "stop --level abort": Cause(stop_by_command(StopLevel.ABORT), BLOCK_S + ABORT_S + MARGIN_S),
    "stop --level off": Cause(stop_by_command(StopLevel.OFF), BLOCK_S + MARGIN_S),
    "viewer gone": Cause(Laboratory.forget_viewer, 0.55 + BLOCK_S + ABORT_S + MARGIN_S),
    "limit passed": Cause(
        lambda laboratory: laboratory.virtual.faults.turn_amplifier_gain(40.0),
        # Time counts from the change of gain; while the drive ramps up, it exceeds the limit later.
        RAMP_S + 2 * BLOCK_S + ABORT_S + MARGIN_S,
    ),
    "samples lost": Cause(lose_samples, BLOCK_S + MARGIN_S),
    "disk refuses": Cause(refuse_writing, 0.5 + BLOCK_S + MARGIN_S),
    "SIGTERM": Cause(
        lambda laboratory: os.kill(laboratory.pid, signal.SIGTERM), BLOCK_S + ABORT_S + MARGIN_S
    ),
}


@contextmanager
def idle(_: WatchedRun) -> Iterator[None]:
    """Change nothing."""
    yield


@contextmanager
def busy(_: WatchedRun | None = None) -> Iterator[None]:
    """Run one busy process per core."""
    with ExitStack() as stack:
        for _ in range(os.cpu_count() or 1):
            process = subprocess.Popen([sys.executable, "-c", BUSY])
            stack.callback(process.wait)
            stack.callback(process.kill)
        time.sleep(0.2)
        yield


@contextmanager
def connections(laboratory: Laboratory) -> Iterator[None]:
    """Open two thousand connections to the engine that send nothing."""
    assert laboratory.engine is not None
    address = laboratory.engine.address
    with ExitStack() as stack:
        for _ in range(2000):
            each = stack.enter_context(socket.socket())
            each.setblocking(False)  # noqa: FBT003 - the socket's own parameter
            each.connect_ex((address.host, address.port))
        yield


@contextmanager
def limit_resource(run: WatchedRun, what: int, most: int) -> Iterator[None]:
    """Set a resource limit of the engine's process, and restore it at the end."""
    before = resource.prlimit(run.pid, what)
    resource.prlimit(run.pid, what, (most, before[1]))
    try:
        yield
    finally:
        with suppress(ProcessLookupError):
            resource.prlimit(run.pid, what, before)


@contextmanager
def no_descriptors(run: WatchedRun) -> Iterator[None]:
    """Prevent the engine from opening more files."""
    highest = max(int(each.name) for each in Path(f"/proc/{run.pid}/fd").iterdir())
    with limit_resource(run, resource.RLIMIT_NOFILE, highest + 1):
        yield


@contextmanager
def disk_full(run: WatchedRun) -> Iterator[None]:
    """Make every write to a file fail."""
    with limit_resource(run, resource.RLIMIT_FSIZE, 0):
        yield


@contextmanager
def stall_engine(laboratory: Laboratory) -> Iterator[None]:
    """Suspend the engine for a second, then continue it."""
    os.kill(laboratory.pid, signal.SIGSTOP)
    begun_s = time.monotonic()
    try:
        yield
    finally:
        time.sleep(max(0.0, begun_s + STALL_S - time.monotonic()))
        os.kill(laboratory.pid, signal.SIGCONT)


CONDITIONS = {
    "idle": idle,
    "both cores busy": busy,
    "stopped, continued": stall_engine,
    "2,000 connections": connections,
    "no descriptors": no_descriptors,
    "disk full": disk_full,
}


def measure_cell(laboratory: Laboratory, cause: str, state: str, condition: str) -> float:
    """Run one cell and return its time to silence [s]."""
    laboratory.ready()
    before = resource.prlimit(laboratory.pid, resource.RLIMIT_FSIZE)
    with ExitStack() as stack:
        stack.callback(laboratory.virtual.faults.heal)
        laboratory.run_into(state)
        if condition == "stopped, continued":
            with stall_engine(laboratory):
                CAUSES[cause].happen(laboratory)
            since_s = time.monotonic()
        else:
            stack.enter_context(CONDITIONS[condition](laboratory))
            since_s = time.monotonic()
            CAUSES[cause].happen(laboratory)
        took_s = laboratory.witness.silent_since_s() - since_s
    with suppress(ProcessLookupError):
        resource.prlimit(laboratory.pid, resource.RLIMIT_FSIZE, before)
    if cause == "SIGTERM":
        laboratory.wait_until(lambda: laboratory.engine is None or not laboratory.engine.is_alive, "end")
    else:
        with suppress(EngineError):
            laboratory.client.close()
    return max(took_s, 0.0)


def table(laboratory: Laboratory, share: float, seed: int) -> bool:
    """Measure cells in random order, print the worst times; return whether all were within the bounds."""
    cells = list(product(CAUSES, STATES, CONDITIONS))
    random.Random(seed).shuffle(cells)
    cells = cells[: max(1, round(share * len(cells)))]
    found: dict[tuple[str, str], list[tuple[float, str]]] = {}
    for number, (cause, state, condition) in enumerate(cells, start=1):
        took_s = measure_cell(laboratory, cause, state, condition)
        found.setdefault((cause, condition), []).append((took_s, state))
        late = "  LATE" if took_s > CAUSES[cause].within_s else ""
        print(f"{number:3d} {cause:20s} {state:14s} {condition:20s} {took_s:6.3f} s{late}", flush=True)
    print(f"\n| cause | within | {' | '.join(CONDITIONS)} |")
    print(f"|---|---|{'---|' * len(CONDITIONS)}")
    for cause, facts in CAUSES.items():
        worst = [max(found.get((cause, each), [(np.nan, "")])) for each in CONDITIONS]
        row = " | ".join("" if np.isnan(took_s) else f"{took_s:.2f} ({state})" for took_s, state in worst)
        print(f"| {cause} | {facts.within_s:.2f} | {row} |")
    return all(took_s <= CAUSES[cause].within_s for (cause, _), each in found.items() for took_s, _ in each)


def try_conditions(laboratory: Laboratory, tries: int, commands: int) -> bool:
    """Count how often a running engine is not found under each condition; return whether it always was."""
    missed = 0
    for condition, make in CONDITIONS.items():
        laboratory.ready()
        # A stop of a suspended engine waits for a timeout, so make fewer of these.
        count, most = tries // len(CONDITIONS), commands // len(CONDITIONS) + 1
        delivered: dict[str, int] = {}
        began_s = time.monotonic()
        with make(laboratory):
            for number in range(count):
                try:
                    engine = the_engine(laboratory.pid)
                    is_due = condition != "stopped, continued" or number < 10
                    how = stop_engine(engine, StopLevel.ABORT).value if is_due else "found"
                except EngineError as error:
                    how, missed = f"MISSED: {error}", missed + 1
                delivered[how] = delivered.get(how, 0) + 1
            for _ in range(most):
                command = [sys.executable, "-m", "vibench.cli", "stop", "--pid", str(laboratory.pid)]
                said = subprocess.run(command, capture_output=True, text=True, check=False)
                how = "the command: " + (
                    "MISSED" if "no engine" in said.stderr else f"exit {said.returncode}"
                )
                missed += "no engine" in said.stderr
                delivered[how] = delivered.get(how, 0) + 1
        print(f"{condition}: {delivered} in {time.monotonic() - began_s:.0f} s", flush=True)
    print(f"a running engine was not found {missed} times")
    return missed == 0


def wall_rig() -> Rig:
    """Return the shipped rig in real time, at low rates that leave the processor to the conditions."""
    rig = load_rig(RIG)
    assert rig.virtual is not None
    virtual = rig.virtual.model_copy(update={"pace": "wall", "grid_rate_hz": 25_600.0})
    daq = rig.daq.model_copy(update={"sample_rate_hz": 12_800.0})
    return rig.model_copy(update={"virtual": virtual, "daq": daq})


def main() -> None:
    """Measure, and exit with code 0 if every time was within its bound."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--cells", type=float, default=1.0, help="share of the table")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--tries", type=int, default=0)
    parser.add_argument("--commands", type=int, default=0)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder, VirtualRig(wall_rig()) as virtual:
        os.environ["VIBENCH_STATE_DIR"] = str(Path(folder) / "state")
        laboratory = Laboratory(virtual, Path(folder))
        try:
            if options.tries or options.commands:
                holds = try_conditions(laboratory, options.tries, options.commands)
            else:
                holds = table(laboratory, options.cells, options.seed)
        finally:
            laboratory.close()
    raise SystemExit(not holds)


if __name__ == "__main__":
    main()
