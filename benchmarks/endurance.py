"""Run one engine for hours; watch memory, descriptors and threads, and count gaps in the recordings.

    python benchmarks/endurance.py --pace wall --minutes 120 --window on
    python benchmarks/endurance.py --pace free --minutes 60 --window off --save free_off.json

The virtual rig records dwells with impacts and noise, one after the other. With pace "wall" it runs in real
time, with "free" much faster. Each complete recording is read, its gaps are counted, and it is deleted.
Results are saved repeatedly, so that a killed run also has results. Slopes are least-squares fits with
standard errors, without the first quarter of the time, in which buffers fill.
"""

import argparse
import json
import os
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")

from vibench.acquisition import open_recording
from vibench.acquisition.engine import (
    DRIVING,
    CampaignRequest,
    EngineClient,
    EngineState,
    announced_engines,
    start_engine,
)
from vibench.acquisition.plan import Campaign
from vibench.acquisition.rig import Rig, load_rig

ROOT = Path(__file__).resolve().parent.parent
LOOK_S = 5.0
"""Interval between two observations of processes and recordings [s]."""
BLOCKS = 3
"""Number of alternations between dwells and noise in a campaign."""
SETTLED = 0.25
"""Share of the time in which buffers fill; it is left out of the slopes."""
PAGE = os.sysconf("SC_PAGE_SIZE")
NUMBERS = ("engine_mb", "engine_descriptors", "engine_threads", "window_mb", "window_descriptors")


@dataclass(frozen=True)
class Look:
    """State of both processes at one moment."""

    time_s: float
    rig_s: float
    """Total duration of all complete recordings [s]."""
    engine_mb: float
    engine_descriptors: int
    engine_threads: int
    window_mb: float
    """Memory of this process, which is the window or only a client [MB]."""
    window_descriptors: int


def campaign(rounds: int) -> Campaign:
    """Return a campaign that alternates dwells and noise, each repeated ``rounds`` times."""
    shared = {"amplitude_vpp": 1.5, "settle_s": 1.0}
    dwell = {**shared, "kind": "dwell", "frequency_hz": 260.0, "duration_s": 40.0}
    band = {"band_start_hz": 50.0, "band_stop_hz": 600.0, "realisations": 8}
    noise = {**shared, **band, "kind": "multisine_noise"}
    excitations = [dwell, noise] * BLOCKS
    each = [
        {"name": f"block_{number}", "ramp_s": 0.5, "repeats": rounds, "excitation": excitation}
        for number, excitation in enumerate(excitations)
    ]
    return Campaign.model_validate({"name": "endurance", "measurements": each})


class Watch:
    """Observer of the engine process, of this process, and of the recordings."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._began_s = time.monotonic()
        (announcement,) = announced_engines()
        self._engine = announcement.pid
        self.looks: list[Look] = []
        self.recordings = self.gaps = self.lost = 0
        self._rig_s = 0.0

    @property
    def elapsed_s(self) -> float:
        """Time since the beginning [s]."""
        return time.monotonic() - self._began_s

    def look(self) -> None:
        """Record the current state, and read the complete recordings."""
        self._read_complete()
        engine, own = Path(f"/proc/{self._engine}"), Path("/proc/self")
        self.looks.append(
            Look(
                self.elapsed_s, self._rig_s, _resident_mb(engine), _count(engine / "fd"),
                _count(engine / "task"), _resident_mb(own), _count(own / "fd"),
            )
        )  # fmt: skip

    def _read_complete(self) -> None:
        for path in sorted(self._folder.glob("*.h5")):
            with open_recording(path) as recording:
                self.recordings += 1
                self.gaps += len(recording.gaps)
                self.lost += sum(gap.last_sample - gap.first_sample + 1 for gap in recording.gaps)
                self._rig_s += recording.duration_s
            path.unlink()

    def document(self) -> dict[str, object]:
        """Return all results as a JSON document for `--save`."""
        return {
            "recordings": self.recordings,
            "gaps": self.gaps,
            "lost_samples": self.lost,
            "looks": [asdict(look) for look in self.looks],
        }


def _resident_mb(process: Path) -> float:
    return int((process / "statm").read_text(encoding="ascii").split()[1]) * PAGE / 1e6


def _count(folder: Path) -> int:
    return sum(1 for _ in folder.iterdir())


def slope_per_h(looks: list[Look], name: str) -> tuple[float, float]:
    """Return the growth of a number per hour and its standard error; NaN after too few observations."""
    kept = [look for look in looks if look.time_s > SETTLED * looks[-1].time_s]
    if len(kept) < len(("slope", "offset", "error")) + 1:
        return float("nan"), float("nan")
    hours = np.array([look.time_s for look in kept]) / 3600
    values = np.array([getattr(look, name) for look in kept], dtype=float)
    found, covariance = np.polyfit(hours, values, 1, cov=True)
    return float(found[0]), float(np.sqrt(covariance[0, 0]))


@contextmanager
def without_window(rig: Rig, plan: Campaign, folder: Path) -> Iterator[Callable[[float], None]]:
    """Run the campaign with an unattended engine; yields a function that waits."""
    with start_engine("unattended") as engine:
        client = engine.client
        client.open(rig)
        _until(client, EngineState.READY)
        client.check(folder)
        _until(client, EngineState.READY)
        client.arm(plan, folder)
        client.start()
        yield time.sleep
        client.stop("off")


def _until(client: EngineClient, state: EngineState) -> None:
    while client.status().state is not state:
        time.sleep(0.1)


@contextmanager
def with_window(rig: Rig, plan: Campaign, folder: Path) -> Iterator[Callable[[float], None]]:
    """Run the campaign in a window; yields a function that waits while the window stays alive."""
    from PySide6.QtCore import QEventLoop, QTimer  # noqa: PLC0415 - only where there is a window
    from PySide6.QtWidgets import QApplication  # noqa: PLC0415

    from vibench.gui.page.app_context import AppContext, Settings  # noqa: PLC0415
    from vibench.gui.window.window import PAGES, Window  # noqa: PLC0415

    app = QApplication(["vibench"])
    window = Window(AppContext(Settings(folder.parent / "window.ini")), PAGES)
    window.show()
    bridge = window.context.bridge

    def wait(seconds: float) -> None:
        loop = QEventLoop()
        QTimer.singleShot(round(1000 * seconds), loop.quit)
        loop.exec()

    def wait_until(state: EngineState) -> None:
        while bridge.state is not state:
            wait(0.1)

    bridge.open(rig, None)
    wait_until(EngineState.READY)
    bridge.order(lambda client: client.check(folder))
    wait(1.0)
    wait_until(EngineState.READY)
    bridge.arm(CampaignRequest(campaign=plan, folder=folder))
    wait_until(EngineState.ARMED)
    bridge.order(EngineClient.start)
    try:
        yield wait
    finally:
        # Stop first, because closing the window during a run would open a question.
        bridge.order(lambda client: client.stop("off"))
        while bridge.state in DRIVING:
            wait(0.1)
        window.close()
        app.processEvents()


def endure(options: argparse.Namespace, folder: Path) -> Watch:
    """Run for the requested time, and observe at regular intervals."""
    rig = load_rig(ROOT / "hardware_configs" / "virtual_rig.toml")
    rig = rig.model_copy(update={"virtual": rig.virtual.model_copy(update={"pace": options.pace})})
    recordings = folder / "recordings"
    recordings.mkdir()
    run = with_window if options.window == "on" else without_window
    with ExitStack() as inside:
        wait = inside.enter_context(run(rig, campaign(options.rounds), recordings))
        watch = Watch(recordings)
        while watch.elapsed_s < 60 * options.minutes:
            wait(LOOK_S)
            watch.look()
            if options.save is not None:
                options.save.write_text(json.dumps(watch.document()), encoding="utf-8")
    return watch


def main() -> None:
    """Run the test and print the slopes."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--pace", choices=("wall", "free"), default="wall")
    parser.add_argument("--minutes", type=float, default=10.0, help="of the clock")
    parser.add_argument("--window", choices=("on", "off"), default="off")
    parser.add_argument("--rounds", type=int, default=200, help="recordings of each of the six blocks")
    parser.add_argument("--save", type=Path, metavar="FILE.json")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="vibench_endurance_") as name:
        os.environ["VIBENCH_STATE_DIR"] = str(Path(name) / "state")
        watch = endure(options, Path(name))
    last = watch.looks[-1]
    print(
        f"pace {options.pace}, window {options.window}: {last.time_s / 60:.1f} min of the clock, "
        f"{last.rig_s / 60:.1f} min of the rig in {watch.recordings} recordings, {watch.gaps} gaps of "
        f"{watch.lost} samples"
    )
    for name in NUMBERS:
        first = next(look for look in watch.looks if look.time_s > SETTLED * last.time_s)
        slope, error = slope_per_h(watch.looks, name)
        print(
            f"  {name:20} {getattr(first, name):8.1f} -> {getattr(last, name):8.1f}   "
            f"{slope:+8.2f} +- {error:.2f} an hour"
        )


if __name__ == "__main__":  # the engine's and the window's own workers import this file
    main()
