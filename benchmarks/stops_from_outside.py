"""Test whether the generator's output is silent after every stop, for all states, conditions and causes.

    python benchmarks/stops_from_outside.py --seed 42 --count 300 --shard 1/2 --save stops_1.jsonl
    python benchmarks/stops_from_outside.py --only window idle --seed 42 --save windows.jsonl
    python benchmarks/stops_from_outside.py --dead-man --seed 42 --count 60 --save kills.jsonl
    python benchmarks/stops_from_outside.py --sum stops_*.jsonl

This process runs the virtual rig in real time, and a witness that watches the generator's output. Another
process drives the rig through the same interfaces as real instruments: `vibench measure` on a separate
terminal, the window (offscreen), or a process that attends an engine. Each cell of the test runs one such
process. The run reaches the state, the condition is created, the cause happens, and the witness waits for
silence. Time counts from Enter, because `vibench stop` is the installed command. Cells are drawn by the seed
and written to ``--save`` one by one; stored cells are not measured again. Linux only; two conditions need a C
compiler.
"""

import argparse
import json
import os
import random
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager, suppress
from dataclasses import asdict, astuple, dataclass
from itertools import product
from pathlib import Path

from time_to_silence import (
    ABORT_S,
    BLOCK_S,
    MARGIN_S,
    PATIENCE_S,
    PLAN,
    RAMP_S,
    STATES,
    STOP_INTO,
    WatchedRun,
    busy,
    disk_full,
    idle,
    limit_resource,
    no_descriptors,
    wall_rig,
)

from vibench.acquisition import CheckRule, load_toml, save_toml
from vibench.acquisition.engine import (
    Announcement,
    Attendant,
    CampaignRequest,
    EngineClient,
    EngineError,
    EngineState,
    announced_engines,
    start_engine,
)
from vibench.acquisition.plan import Campaign
from vibench.acquisition.rig import KnobSheet, Rig, save_knob_sheet
from vibench.acquisition.stopping.program import signal_name, stop_signals
from vibench.virtual_rig import VirtualRig

VIBENCH = str(Path(sys.executable).with_name("vibench"))
ENTER_S = 0.2
"""Time that a command takes to start on an idle computer [s]."""
LOADED_S = 3.0
"""Allowed time from Enter for an abort on an overloaded computer [s]."""
STANDSTILL_S = 1.5
"""Allowed time to silence a stopped run that no longer advances [s]."""
DEAD_MAN_S = 1.0
LATE_S = 0.3
"""Interval between checks by the witness on a busy computer [s]."""
SHIM = Path(__file__).with_name("shim_of_conditions.c")
ENDED_BY_ITSELF = ("folder gone", "disk full", "memory exhausted")
"""Conditions that may end a run before its stop, or prevent its recording from being finished."""


@dataclass(frozen=True)
class Cell:
    """One stop: the driving program, cause, condition and state."""

    subject: str
    cause: str
    condition: str
    state: str


@dataclass(frozen=True)
class CellResult:
    """Result of one cell."""

    cell: Cell
    took_s: float
    within_s: float
    exits: dict[str, int | None]
    load: float

    @property
    def complaint(self) -> str:
        """Description of what is wrong; empty if nothing is."""
        if self.took_s > self.within_s:
            return f"silent after {self.took_s:.2f} s, {self.within_s:.2f} s are allowed"
        may_have_ended = self.cell.condition in ENDED_BY_ITSELF
        for what, code in self.exits.items():
            allowed = {0} if what == "stop" else {1, 3, 130} if self.cell.cause == "Ctrl-C twice" else {1, 3}
            if what == "stop" and may_have_ended:
                allowed = {0, 1}
            is_over_limit = what == "measure" and self.cell.cause == "limit passed"
            # No limit applies during the ramp of a stop, so such a run counts as stopped by a person.
            if is_over_limit and self.cell.state != "ramping_down":
                allowed = {1}
            elif what == "measure" and not may_have_ended and self.cell.cause != "Ctrl-C twice":
                allowed = {3}
            if code not in allowed:
                return f"{what} exited with {code}; {sorted(allowed)} are allowed"
        return ""


class Laboratory(WatchedRun):
    """A rig under watch, and one process that drives it."""

    def __init__(self, virtual: VirtualRig, folder: Path, dead_man_s: float | None) -> None:
        super().__init__(virtual, folder, dead_man_s=dead_man_s)
        self.rig_path, self.knobs_path = folder / "rig.json", folder / "knobs.toml"
        self.rig_path.write_text(self.served.model_dump_json())
        save_knob_sheet(self.sheet, self.knobs_path)
        self.recordings = folder / "0"
        self.process: subprocess.Popen[bytes]
        self.engine: Announcement
        self._terminal = -1
        self._said = b""

    @property
    def pid(self) -> int:
        """Process id of the driving process."""
        return self.engine.pid

    def start(self, subject: str) -> None:
        """Start the process that drives the rig."""
        self.recordings = self.folder / str(int(self.recordings.name) + 1)
        self._said = b""
        self._terminal, slave = os.openpty()
        words = [subject, str(self.rig_path), str(self.knobs_path), str(self.recordings)]
        script = [sys.executable, __file__, "--as", *words]
        # A session leader gets the first terminal that it opens as its controlling terminal.
        shell = f'exec "$@" <{os.ttyname(slave)} >{os.ttyname(slave)} 2>&1'
        self.process = subprocess.Popen(["/bin/sh", "-c", shell, "sh", *script], start_new_session=True)
        os.close(slave)
        threading.Thread(target=self._read, args=(self._terminal,), daemon=True).start()
        self.wait_until(self._is_announced, "engine")
        self.client = EngineClient.attach(self.engine.address, patience_s=PATIENCE_S)

    def run_into(self, state: str, after_s: float) -> None:
        """Wait for a state of the run, and then for ``after_s``."""
        first = "recording" if state in STOP_INTO else state
        self.wait_until(lambda: self.is_in(first), first)
        self.stop_into(state)
        time.sleep(after_s)

    def type(self, keys: bytes) -> None:
        """Type keys on the terminal of the process."""
        os.write(self._terminal, keys)

    def wait_until(self, is_so: Callable[[], bool], what: str) -> None:
        """Wait for a condition; raise TimeoutError if it takes too long or the process ends."""
        give_up_s = time.monotonic() + 2 * PATIENCE_S
        while not is_so():
            if time.monotonic() > give_up_s or self.process.poll() is not None:
                raise TimeoutError(f"no {what}: {self._said.decode(errors='replace')[-300:]}")
            time.sleep(0.005)

    def exit_code(self) -> int | None:
        """Wait for the process to end and return its exit code; None if it continues."""
        try:
            return self.process.wait(PATIENCE_S)
        except subprocess.TimeoutExpired:
            return None

    def close(self) -> str:
        """End all processes that still run; return the last output on the terminal."""
        with suppress(EngineError, OSError, AttributeError):
            self.client.close()
        self.process.kill()
        self.process.wait()
        for each in announced_engines():
            with suppress(ProcessLookupError):
                os.kill(each.pid, signal.SIGKILL)
        with suppress(OSError):
            os.close(self._terminal)
        return self._said.decode(errors="replace")[-400:]

    def _is_announced(self) -> bool:
        for each in announced_engines():
            self.engine = each
            return True
        return False

    def _read(self, terminal: int) -> None:
        with suppress(OSError):
            while said := os.read(terminal, 4096):
                self._said = (self._said + said)[-4000:]


def stop_by_command(level: str) -> Callable[[Laboratory], int]:
    """Return a function that runs `vibench stop` and returns its exit code."""

    def stop(_: Laboratory) -> int:
        command = [VIBENCH, "stop", "--level", level, "--reason", "witness"]
        told = subprocess.run(command, capture_output=True, text=True, check=False)
        if told.returncode and "switch the amplifier off" not in told.stderr + "no engine is running":
            raise SystemExit(told.stderr)
        return told.returncode

    return stop


def send(number: int) -> Callable[[Laboratory], None]:
    """Return a function that sends a signal to the driving process."""
    return lambda laboratory: os.kill(laboratory.pid, number)


def press_twice(laboratory: Laboratory) -> None:
    """Press Ctrl-C twice."""
    laboratory.type(b"\x03")
    time.sleep(0.1)
    laboratory.type(b"\x03")


SUBJECTS = ("measure", "engine")
WITHIN_ABORT_S = BLOCK_S + ABORT_S + MARGIN_S
Happening = Callable[[Laboratory], int | None]
CAUSES: dict[str, tuple[Happening, float, tuple[str, ...]]] = {
    "stop --level ramp": (
        stop_by_command("ramp"), BLOCK_S + RAMP_S + MARGIN_S + ENTER_S, SUBJECTS
    ),
    "stop --level abort": (stop_by_command("abort"), WITHIN_ABORT_S + ENTER_S, SUBJECTS),
    "stop --level off": (stop_by_command("off"), BLOCK_S + MARGIN_S + ENTER_S, SUBJECTS),
    "Ctrl-C once": (lambda each: each.type(b"\x03"), BLOCK_S + RAMP_S + MARGIN_S, ("measure",)),
    "Ctrl-C twice": (press_twice, BLOCK_S + RAMP_S + MARGIN_S, ("measure",)),
    "window killed": (lambda each: each.process.kill(), WITHIN_ABORT_S, ("engine", "window")),
    "viewer gone": (
        lambda each: each.process.send_signal(signal.SIGSTOP), 2.55 + WITHIN_ABORT_S, ("engine", "window")
    ),
    "limit passed": (
        lambda each: each.virtual.faults.turn_amplifier_gain(40.0), RAMP_S + BLOCK_S + WITHIN_ABORT_S,
        SUBJECTS,
    ),
    **{
        signal_name(number): (
            send(number), WITHIN_ABORT_S + (RAMP_S if number == signal.SIGINT else 0.0), SUBJECTS
        )
        for number in sorted({*stop_signals(), signal.SIGHUP})  # nohup must not change the draw
        if signal_name(number) in signal.Signals.__members__
    },
}  # fmt: skip


@contextmanager
def exhaust_memory(laboratory: Laboratory) -> Iterator[None]:
    """Limit the memory of the process to its present size."""
    status = Path(f"/proc/{laboratory.pid}/status").read_text()
    size_kb = next(int(line.split()[1]) for line in status.splitlines() if line.startswith("VmSize"))
    with limit_resource(laboratory, resource.RLIMIT_AS, 1024 * size_kb):
        yield


@contextmanager
def remove_folder(laboratory: Laboratory) -> Iterator[None]:
    """Remove the folder of the recordings."""
    shutil.rmtree(laboratory.recordings, ignore_errors=True)
    yield


def with_shim(condition: str) -> Callable[[Laboratory], AbstractContextManager[None]]:
    """Return a function that starts a condition of the shim."""

    @contextmanager
    def make(laboratory: Laboratory) -> Iterator[None]:
        flag = Path(os.environ["SHIM_FOLDER"]) / f"{condition}.{laboratory.pid}"
        flag.touch()
        yield
        flag.unlink()

    return make


CONDITIONS: dict[str, Callable[[Laboratory], AbstractContextManager[None]]] = {
    "idle": idle,
    "busy": busy,
    "memory exhausted": exhaust_memory,
    "no descriptors": no_descriptors,
    "no threads": with_shim("no threads"),
    "folder gone": remove_folder,
    "disk full": disk_full,
    "clock stepped": with_shim("clock stepped"),
}
LASTING = ("settling", "recording", "held")
DEAD_STATES = tuple(each for each in STATES if each != "held")


def bound_s(cell: Cell, load: float) -> float:
    """Return the time within which the output must be silent [s]."""
    within_s = CAUSES[cell.cause][1]
    if cell.condition == "memory exhausted":
        within_s += STANDSTILL_S
    return max(within_s, LOADED_S) if load > 2 * (os.cpu_count() or 1) else within_s


def measure_cell(laboratory: Laboratory, cell: Cell, after_s: float) -> CellResult:
    """Run one cell and return its result."""
    happen, _, _ = CAUSES[cell.cause]
    exits: dict[str, int | None] = {}
    load = os.getloadavg()[0]
    with ExitStack() as stack:
        stack.callback(laboratory.virtual.faults.heal)
        laboratory.start(cell.subject)
        laboratory.run_into(cell.state, after_s)
        stack.enter_context(CONDITIONS[cell.condition](laboratory))
        since_s = time.monotonic()
        code = happen(laboratory)
        took_s = max(0.0, laboratory.witness.silent_since_s() - since_s)
        if cell.cause.startswith("stop "):
            exits["stop"] = code
        if cell.subject == "measure":
            exits["measure"] = laboratory.exit_code()
    return CellResult(cell, took_s, bound_s(cell, load), exits, load)


def kill_driver(laboratory: Laboratory, cell: Cell, after_s: float) -> CellResult:
    """Kill the driving process; with a dead man's switch, the drive must end by itself."""
    load = os.getloadavg()[0]
    laboratory.start(cell.subject)
    laboratory.run_into(cell.state, after_s)
    since_s = time.monotonic()
    os.kill(laboratory.pid, signal.SIGKILL)
    took_s = max(0.0, laboratory.witness.silent_since_s() - since_s)
    return CellResult(cell, took_s, DEAD_MAN_S + LATE_S, {}, load)


def stop_cells() -> list[Cell]:
    """Return all cells of stops."""
    return [
        Cell(subject, cause, condition, state)
        for (cause, (_, _, subjects)), condition, state in product(CAUSES.items(), CONDITIONS, STATES)
        for subject in subjects
    ]


def kill_cells() -> list[Cell]:
    """Return 20 kills for every state with a dead man's switch, each at another random moment."""
    return [Cell(subject, "SIGKILL", "idle", state) for subject in SUBJECTS for state in DEAD_STATES] * 20


def drive(subject: str, rig_path: str, knobs: str, folder: str) -> None:
    """Run as the driving process: `vibench measure`, the window, or a program that attends an engine."""
    signal.signal(signal.SIGHUP, signal.SIG_DFL)
    rig = Rig.model_validate_json(Path(rig_path).read_text())
    campaign = Path(folder).with_suffix(".toml")
    plan = Campaign.model_validate(PLAN)
    if subject == "measure":
        save_toml(plan, campaign)
        bench = Path(folder).with_suffix(".rig.toml")
        save_toml(rig, bench)
        given = ["--bench", str(bench), "--knobs", knobs, "--out", folder, "--check", "waived"]
        os.execv(VIBENCH, [VIBENCH, "measure", str(campaign), *given])
    sheet = load_toml(Path(knobs), KnobSheet)
    request = CampaignRequest(campaign=plan, folder=Path(folder), check=CheckRule.WAIVED)
    if subject == "window":
        show_window(rig, sheet, request)
    with start_engine() as engine:
        attendant = Attendant(engine.address)
        engine.client.open(rig, sheet)
        while engine.client.status().state is EngineState.OPENING:
            attendant.live()
            time.sleep(0.02)
        engine.client.arm_request(request)
        engine.client.start()
        while True:
            attendant.live()
            time.sleep(0.02)


def show_window(rig: Rig, sheet: KnobSheet, request: CampaignRequest) -> None:
    """Open the window, arm and start the campaign, and wait until killed."""
    os.environ["QT_QPA_PLATFORM"] = "offscreen"
    from PySide6.QtCore import QTimer  # noqa: PLC0415 - of this subject only

    from vibench.gui.page.app_context import AppContext, Settings  # noqa: PLC0415
    from vibench.gui.window.window import (  # noqa: PLC0415
        PAGES,
        Window,
        application,
    )

    app = application(["vibench"])
    window = Window(AppContext(Settings(request.folder.with_suffix(".ini"))), PAGES)
    window.show()
    bridge = window.context.bridge
    bridge.open(rig, sheet)
    steps = {
        EngineState.READY: lambda: bridge.arm(request),
        EngineState.ARMED: lambda: bridge.order(EngineClient.start),
    }

    def go_on() -> None:
        if bridge.state in steps:
            steps.pop(bridge.state)()

    timer = QTimer()
    timer.timeout.connect(go_on)
    timer.start(20)
    app.exec()


def compile_shim(folder: Path) -> Path | None:
    """Compile the shim; return None without a compiler."""
    compiler, shim = shutil.which("cc"), folder / "shim.so"
    if compiler is None:
        return None
    subprocess.run([compiler, "-shared", "-fPIC", "-O2", "-o", shim, SHIM, "-ldl"], check=True)
    return shim


def campaign(options: argparse.Namespace, folder: Path) -> Iterable[CellResult]:
    """Measure the cells of a shard that are not in the file yet."""
    number, count = (int(each) for each in options.shard.split("/"))
    chooser = random.Random(options.seed)
    cells = kill_cells() if options.dead_man else stop_cells()
    cells = [each for each in cells if {*options.only} <= {*astuple(each)}]
    chooser.shuffle(cells)
    chosen = [(at, cell, chooser.uniform(0.0, 0.3)) for at, cell in enumerate(cells[: options.count])]
    done = {json.loads(line)["number"] for line in _lines(options.save)}
    carry_out = kill_driver if options.dead_man else measure_cell
    for at, cell, after_s in chosen:
        if at % count != number - 1 or at in done:
            continue
        found, said = None, ""
        for attempt in range(3):  # on a busy computer a check may fail, or a state may be missed
            place = folder / f"{at}-{attempt}"
            place.mkdir()
            # A killed program stays announced until its own generator, which is gone with its rig, is opened.
            os.environ["VIBENCH_STATE_DIR"] = str(place / "state")
            # A new rig each time, because a killed client leaves its task in the old one.
            with VirtualRig(wall_rig()) as virtual:
                laboratory = Laboratory(virtual, place, DEAD_MAN_S if options.dead_man else None)
                try:
                    found = carry_out(laboratory, cell, after_s if cell.state in LASTING else 0.0)
                    break
                except (TimeoutError, EngineError) as error:
                    said = str(error)
                finally:
                    words = laboratory.close()
        if found is None:
            print(f"{at:4d} {cell}: NOT MEASURED {said} {words}", flush=True)
            continue
        line = asdict(found) | {"number": at, "complaint": found.complaint}
        with options.save.open("a") as file:
            file.write(json.dumps(line | ({"said": words} if found.complaint else {})) + "\n")
        print(
            f"{at:4d} {cell.subject:8s} {cell.cause:18s} {cell.condition:17s} {cell.state:13s} "
            f"{found.took_s:6.2f} s of {found.within_s:.2f} {found.exits} load {found.load:.0f} "
            f"{found.complaint.upper()}",
            flush=True,
        )
        yield found


def _lines(path: Path) -> list[str]:
    return path.read_text().splitlines() if path.exists() else []


def print_totals(paths: list[Path]) -> bool:
    """Print how many stops were silent in time, and the worst of each cause; return whether all were."""
    found = [json.loads(line) for path in paths for line in _lines(path)]
    keys = ("took_s", "within_s", "exits", "load")
    for each in found:
        each["complaint"] = CellResult(Cell(**each["cell"]), *(each[key] for key in keys)).complaint
    bad = [each for each in found if each["complaint"]]
    print(f"{len(found) - len(bad)} of {len(found)} stops: silent in time, with the right exit code")
    for key in ("cause", "condition", "state"):
        for name in sorted({each["cell"][key] for each in found}):
            of = [each for each in found if each["cell"][key] == name]
            worst = max(of, key=lambda each: each["took_s"])
            print(
                f"| {name} | {len(of)} | {worst['took_s']:.2f} s of {worst['within_s']:.2f} s "
                f"({worst['cell']['condition']}, {worst['cell']['state']}, load {worst['load']:.0f}) |"
            )
    for each in bad:
        print(each["cell"], each["complaint"])
    return not bad


def main() -> None:
    """Measure, and exit with code 0 if every stop was silent in time."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int, default=300)
    parser.add_argument("--shard", default="1/1")
    parser.add_argument("--save", type=Path, default=Path("stops.jsonl"))
    parser.add_argument("--dead-man", action="store_true", help="kill runs whose drive ends by itself")
    parser.add_argument("--only", nargs="+", default=(), metavar="WORD", help="cells that have these words")
    parser.add_argument("--sum", type=Path, nargs="+")
    parser.add_argument("--as", dest="drive", nargs=4, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.drive:
        drive(*options.drive)
    if options.sum:
        raise SystemExit(not print_totals(options.sum))
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        os.environ |= {"VIBENCH_STATE_DIR": f"{name}/state", "VIBENCH_LOCK_DIR": name, "SHIM_FOLDER": name}
        shim = compile_shim(folder)
        if shim is not None:
            os.environ["LD_PRELOAD"] = str(shim)
        else:
            del CONDITIONS["no threads"], CONDITIONS["clock stepped"]
        complaints = [each.complaint for each in campaign(options, folder)]
    raise SystemExit(any(complaints))


if __name__ == "__main__":
    main()
