"""`vibench watch`, `stop`, `release` and `gui`: watch and control a running engine."""

import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Annotated

import typer

from vibench.acquisition import AcquisitionError, StopLevel, file_path
from vibench.acquisition.engine import (
    DRIVING,
    Announcement,
    EngineClient,
    EngineGone,
    EngineSilent,
    StopDelivery,
    announced_engines,
    out_of_reach,
    programs_to_stop,
    programs_without_engine,
    require_ended,
    stop_engine,
    the_engine,
)
from vibench.stop_files import SWITCH_OFF

from .engine_bars import INTERVAL_S, engine_bars
from .options import option
from .output import console, print_json
from .paths import AsJson, BenchPath

NAME = {"pid", "what", "started_utc"}
Pid = Annotated[int | None, option("Process id; by default the only engine.", "N", name="--pid")]


def watch(pid: Pid = None, as_json: AsJson = False) -> None:
    """Watch a running engine from any terminal of the same user; Ctrl-C does not stop the run."""
    if as_json:
        engines = [each for each in announced_engines() if pid in (None, each.pid)]
        others = [each for each in programs_without_engine() if pid in (None, each.pid)]
        print_json(
            {
                "engines": [_facts(each) for each in engines],
                "programs": [each.model_dump(include=NAME) for each in others],
            }
        )
        return
    engine = the_engine(pid)
    console.print(f"{engine.what}, process {engine.pid}, since {engine.started_utc}; Ctrl-C stops watching.")
    try:
        with EngineClient.attach(engine.address) as client, engine_bars() as bars:
            while (status := client.status()).state in DRIVING:
                bars.draw(status)
                time.sleep(INTERVAL_S)
            bars.draw(status)
    except EngineGone:
        require_ended(engine)
        console.print("The engine has ended.")
    except KeyboardInterrupt:
        console.print("The engine continues.")


def stop(
    pid: Annotated[int | None, option("Process id; by default all (hold: the only one).", "N")] = None,
    level: Annotated[
        StopLevel,
        option("hold: until vibench release; ramp: as planned; abort: shortest ramp; off: at once."),
    ] = StopLevel.RAMP,
    reason: Annotated[str, option("Reason, stored in the recording.")] = "vibench stop",
) -> None:
    """Stop all engines, campaigns, scripts and bench checks that drive a shaker from this computer."""
    programs = programs_to_stop(pid)
    if level is StopLevel.HOLD and len(programs) > 1:
        programs = (the_engine(pid),)
    failures = []
    # Stop all programs in parallel: a program that does not respond must not delay the others.
    with ThreadPoolExecutor(len(programs)) as pool:
        deliveries = [pool.submit(stop_engine, each, level, reason) for each in programs]
        for program, delivery in zip(programs, deliveries, strict=True):
            try:
                console.print(_words(f"{program.what}, process {program.pid}", delivery.result(), level))
            except AcquisitionError as error:
                failures.append(error)
    if elsewhere := out_of_reach():
        console.print(f"{elsewhere}.")
    if len(failures) == 1:
        raise failures[0]
    if failures:
        raise EngineSilent(". ".join(map(str, failures)))


def _words(name: str, delivery: StopDelivery, level: StopLevel) -> str:
    match delivery:
        case StopDelivery.KEPT:
            raise EngineSilent(
                f"{name} runs but does not answer: it hangs, or was suspended. The stop ({level.value}) is "
                "stored, and takes effect when the program answers again. The drive continues until then: in "
                "an emergency, switch the amplifier off by hand"
            )
        case StopDelivery.UNHEEDED:
            raise EngineSilent(
                f"{name} has received the stop ({level.value}) but has not confirmed that its output is off: "
                f"an instrument or the computer hangs. {SWITCH_OFF}"
            )
        case StopDelivery.TOLD if level is StopLevel.HOLD:
            return f"{name}, has received the hold; 'vibench release' resumes the run."
        case StopDelivery.TOLD | StopDelivery.TAKEN:
            return f"{name}, has carried out the stop ({level.value}); its output is off."


def release(pid: Pid = None) -> None:
    """Continue a measurement that `vibench stop --level hold` or the window has put on hold."""
    engine = the_engine(pid)
    with EngineClient.attach(engine.address) as client:
        # Release even a hold that has not taken effect yet, for example during a pause.
        client.resume()
    console.print(f"{engine.what}, process {engine.pid}, has received the release.")


def _facts(engine: Announcement) -> dict[str, object]:
    status, silence = None, ""
    try:
        with EngineClient.attach(engine.address) as client:
            status = client.status().model_dump(mode="json")
    except EngineGone as error:
        silence = str(error)
    return {**engine.model_dump(include=NAME), "status": status, "silence": silence}


WINDOW = "vibench.gui"
"""Package that runs in a new process; if it were imported here, all commands would need Qt."""


def gui(
    bench: BenchPath = None,
    screenshots: Annotated[Path | None, option("Save a picture of each page, and exit.", "DIR")] = None,
) -> None:
    """Open the window, in which you check a bench, plan, run and watch tests, and compare results."""
    command = [sys.executable, "-m", WINDOW]
    if bench is not None:
        command += ["--bench", str(file_path(bench, "hardware_configs"))]
    if screenshots is not None:
        command += ["--screenshots", str(screenshots)]
    ended = subprocess.run(command, check=False)  # noqa: S603 - this interpreter, and our own package
    raise typer.Exit(ended.returncode)
