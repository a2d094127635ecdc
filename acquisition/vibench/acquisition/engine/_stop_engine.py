"""Stopping what drives a bench, whatever its state: the stop is put down, and an engine is told as well."""

from collections.abc import Callable
from contextlib import suppress
from enum import StrEnum
from pathlib import Path
from threading import Event
from time import monotonic

from ..host import chosen
from ..stopping import Program, StopLevel, put_down
from ._announcement import Announcement
from ._client import EngineClient
from ._errors import EngineError, EngineGone, EngineSilent
from ._state import EngineState

PATIENCE_S = 1.0
"""How long an engine may take to answer, and then to take what was put down; both take milliseconds [s]."""
HEEDED_S = 5.0
"""How long an engine that has answered may go on driving; a block and a setting are some tenths [s]."""
LOOK_S = 0.02


class StopDelivery(StrEnum):
    """How a stop has reached a program."""

    TOLD = "told"
    """It has answered."""
    TAKEN = "taken"
    """It has taken the stop that was put down for it: it is no engine, or one that did not answer."""
    UNHEEDED = "unheeded"
    """It has answered, and goes on driving: whatever plays there hangs."""
    KEPT = "kept"
    """It did neither: its process lives, and obeys as soon as it comes back."""


def stop_engine(
    engine: Program, level: StopLevel | str = StopLevel.RAMP, reason: str = "stopped by the operator"
) -> StopDelivery:
    """Stop what an engine, or another program, drives, and the campaign with it.

    The stop is put down in the state folder before the engine is told, so that it is obeyed within a
    twentieth of a second even where no connection comes about, and later where the process stands still.
    A hold is only told: nobody wants one to begin unexpectedly.

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
    path, trouble = _put_down(engine, level, reason)
    if not isinstance(engine, Announcement):
        if path is None:
            raise EngineGone(f"no stop could be left in the state folder for process {engine.pid}: {trouble}")
        return _taken_or_kept(engine, path)
    try:
        delivery = _tell(engine, level, reason)
    except EngineError as error:
        if path is not None:
            return _taken_or_kept(engine, path)
        raise EngineGone(
            f"{error}. Nor could a stop be left for it in the state folder: {trouble}"
        ) from error
    if path is not None:
        with suppress(OSError):
            path.unlink()
    return delivery


def _put_down(engine: Program, level: StopLevel, reason: str) -> tuple[Path | None, str]:
    try:
        return put_down(engine.pid, engine.process_start, level, reason), ""
    except OSError as error:
        return None, str(error)


def _tell(engine: Announcement, level: StopLevel, reason: str) -> StopDelivery:
    with EngineClient.attach(engine.address, patience_s=PATIENCE_S) as client:
        client.stop(level, reason)
        try:
            if level is StopLevel.HOLD or _until(lambda: _heeds(client), HEEDED_S):
                return StopDelivery.TOLD
        except EngineSilent:
            return StopDelivery.UNHEEDED
        except EngineGone:  # a command's engine ends with what it drove
            return StopDelivery.TOLD
    return StopDelivery.UNHEEDED


def _heeds(client: EngineClient) -> bool:
    status = client.status()
    match status.state:
        case EngineState.CHECKING:
            return False
        case EngineState.RUNNING | EngineState.HELD:  # before its first run, and between two, nothing plays
            return status.run is None or status.run.amplitude_vpp == 0.0
        case _:
            return True


def _taken_or_kept(engine: Program, path: Path) -> StopDelivery:
    if _until(lambda: not path.exists(), PATIENCE_S):
        return StopDelivery.TAKEN
    if engine.is_alive:
        return StopDelivery.KEPT
    with suppress(OSError):
        path.unlink()
    raise EngineGone(f"process {engine.pid} ({engine.what}) has ended; look at the bench")


def _until(is_so: Callable[[], bool], within_s: float) -> bool:
    give_up_s, pause = monotonic() + within_s, Event()
    while not is_so():
        if monotonic() > give_up_s:
            return False
        pause.wait(LOOK_S)
    return True
