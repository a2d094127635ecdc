"""Stopping a program that drives a bench, whatever its state: by a file, and by request."""

from collections.abc import Callable
from contextlib import suppress
from enum import StrEnum
from pathlib import Path
from threading import Event
from time import monotonic

from vibench.stop_files import HEEDED_S, SWITCH_OFF, Fate, fate_of, put_down, stop_path

from ..host.chosen import chosen
from ..stopping.program import Program, engines_folder
from ..stopping.stop import StopLevel
from ._client import Announcement, EngineClient
from ._status import SOUNDING, EngineState
from ._wire import EngineError, EngineGone, EngineSilent

PATIENCE_S = 1.0
"""How long an engine may take to answer; it takes milliseconds [s]."""
LOOK_S = 0.02


class StopDelivery(StrEnum):
    """How a stop has reached a program."""

    TOLD = "told"
    """An engine accepted it, and nothing drives: the output was read back as off."""
    TAKEN = "taken"
    """The same for a program that is not an engine."""
    UNHEEDED = "unheeded"
    """The engine accepted it but has not confirmed that its output is off."""
    KEPT = "kept"
    """The engine has not accepted it: its process is alive and obeys when it resumes."""


def stop_engine(
    engine: Program, level: StopLevel | str = StopLevel.RAMP, reason: str = "stopped by the operator"
) -> StopDelivery:
    """Stop what an engine, or another program, drives, and the campaign with it.

    The stop is put down in the state folder, where it is obeyed within a twentieth of a second, and later
    where the process stands still. Returns when the program has confirmed that its output is off, or does
    not. Where no file can be written or removed, the stop is sent over the engine's connection. A hold is
    only sent, never written: nobody wants one to begin unexpectedly.

    Parameters
    ----------
    engine
        As it announced itself.
    level
        How hard it stops.
    reason
        What the recording will say.

    Raises
    ------
    EngineGone
        When the process has ended, or when it could neither be told nor anything be put down.
    EngineError
        When a hold is asked of a program that is no engine.

    """
    level = chosen(StopLevel, level)
    reason = reason.encode(errors="replace").decode()  # a terminal gives what is no text as surrogates
    if level is StopLevel.HOLD:
        if not isinstance(engine, Announcement):
            raise EngineError(
                f"process {engine.pid} ({engine.what}) is no engine and cannot be held. It goes on; stop it: "
                "ramp, abort or off"
            )
        _tell(engine, level, reason)
        return StopDelivery.TOLD
    stop = stop_path(str(engines_folder()), engine.pid, engine.process_start, level)
    try:
        put_down(stop, reason)
    except OSError as error:
        if isinstance(engine, Announcement):
            return _tell(engine, level, reason)
        raise EngineGone(
            f"no stop could be written to the state folder for process {engine.pid}: {error}. {SWITCH_OFF}"
        ) from error
    match fate_of(stop, lambda: engine.is_alive):
        case Fate.SILENT:
            return StopDelivery.TOLD if isinstance(engine, Announcement) else StopDelivery.TAKEN
        case Fate.UNCONFIRMED if engine.is_alive:
            return StopDelivery.UNHEEDED
        case Fate.NOT_TAKEN if engine.is_alive:
            if isinstance(engine, Announcement):
                with suppress(EngineError):  # it hangs: the stop is kept
                    return _tell(engine, level, reason)
            return StopDelivery.KEPT
    with suppress(OSError):
        Path(stop).unlink()
    raise EngineGone(
        f"process {engine.pid} ({engine.what}) has ended and has not confirmed that its output is off. "
        f"{SWITCH_OFF}"
    )


def _tell(engine: Announcement, level: StopLevel, reason: str) -> StopDelivery:
    with EngineClient.attach(engine.address, patience_s=PATIENCE_S) as client:
        client.stop(level, reason)
        try:
            if level is StopLevel.HOLD or _until(lambda: _heeds(client), HEEDED_S):
                return StopDelivery.TOLD
        except EngineSilent:
            return StopDelivery.UNHEEDED
    return StopDelivery.UNHEEDED


def _heeds(client: EngineClient) -> bool:
    status = client.status()
    is_silent = status.run is not None and status.run.amplitude_vpp == 0.0
    # Before its first run, and between two, nothing plays.
    is_between = status.state in (EngineState.RUNNING, EngineState.HELD) and status.run is None
    return is_silent or is_between or status.state not in SOUNDING


def _until(is_so: Callable[[], bool], within_s: float) -> bool:
    give_up_s, pause = monotonic() + within_s, Event()
    while not is_so():
        if monotonic() > give_up_s:
            return False
        pause.wait(LOOK_S)
    return True
