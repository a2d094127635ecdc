"""Engines say where they can be asked, in a file that only their user can read."""

import socket
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

from vibench.sim.operating_system.processes import Place
from vibench.sim.operating_system.state_folder import state_folder
from vibench.stop_files import SWITCH_OFF

from ..host.toml_file import FrozenModel
from ..stopping.program import (
    AnyProgram,
    Program,
    announced_programs,
    facts_of_this_process,
    programs_of_other_places,
    reached,
    withdraw,
)
from ..stopping.stop import StopLevel
from ._wire import EngineError, EngineGone


class EngineAddress(FrozenModel):
    """Where an engine can be asked, and the word that lets one in."""

    host: str
    port: int
    token: str


REFUSAL_S = 0.2
"""How long a refusal is waited for; one on this computer comes at once [s]."""


class Announcement(Program):
    """An engine of this user on this computer: a program that can be asked, and not only stopped."""

    address: EngineAddress


@contextmanager
def announced(address: EngineAddress, what: str, press: Callable[[StopLevel, str], None]) -> Iterator[None]:
    """Be found by `announced_engines` while inside; ``press`` carries out the stops that are put down.

    Raises
    ------
    AcquisitionError
        When the state folder cannot be written: nobody could stop what cannot be found.

    """
    told = Announcement.model_validate({**facts_of_this_process(what), "address": address})
    with reached(press, told):
        yield


def announced_engines() -> tuple[Announcement, ...]:
    """Every engine of this computer whose process lives, oldest first, whether it answers or not.

    One that refuses is none: where its process is known to live, it is among `programs_without_engine`.
    """
    found = []
    for told in announced_programs(Announcement):
        if not _refuses(told.address):
            found.append(told)
        elif not told.process_start:
            withdraw(told)
    return tuple(found)


def programs_without_engine() -> tuple[Program, ...]:
    """Every script or check that drives a bench, and every engine that lets nobody in, oldest first."""
    engines = {each.pid for each in announced_engines()}
    return tuple(each for each in announced_programs(Program) if each.pid not in engines)


def the_engine(pid: int | None) -> Announcement:
    """Choose the engine that is meant: the one of that process, or the only one.

    Parameters
    ----------
    pid
        Number of its process; None: the only one.

    Raises
    ------
    EngineError
        When there is none, or more than one and none was named.

    """
    chosen = [each for each in announced_engines() if pid in (None, each.pid)]
    if chosen:
        return _only(chosen)
    wanted = "no engine is running" if pid is None else f"no engine runs as process {pid}"
    others = [each for each in programs_without_engine() if pid in (None, each.pid)]
    if others:
        raise EngineError(
            f"{wanted}; {_named(others)} drives a bench without one, and can only be stopped: 'vibench stop'"
        )
    raise EngineError(
        f"{wanted}; 'vibench measure' and 'vibench gui' start one. It was looked for in {state_folder()}: "
        "one of another user, or with another VIBENCH_STATE_DIR, is stopped from there"
        + "".join(f". {each}" for each in [out_of_reach()] if each)
    )


def programs_to_stop(pid: int | None) -> tuple[Program, ...]:
    """Give what a stop is meant for: engines, and scripts and checks that drive a bench themselves.

    Those of other containers on this computer are among them; what is left in the state folder reaches them.

    Parameters
    ----------
    pid
        Number of a process; None: all of this computer.

    Raises
    ------
    EngineError
        When there is none.

    """
    contained = (each for each in programs_of_other_places() if each.place is Place.CONTAINER)
    programs = (*announced_engines(), *programs_without_engine(), *contained)
    return tuple(each for each in programs if pid in (None, each.pid)) or (the_engine(pid),)


def out_of_reach() -> str:
    """Say what drives on other computers that share the state folder; empty if nothing does."""
    others = [each for each in programs_of_other_places() if each.place is Place.ELSEWHERE]
    named = ", ".join(f"{each.what} (process {each.pid} on {each.computer})" for each in others)
    return f"Not reached, since it is of another computer: {named}; run 'vibench stop' there" if named else ""


def require_ended(engine: Announcement) -> None:
    """Refuse to go on after an engine that was killed: nobody has confirmed that its output is off.

    Parameters
    ----------
    engine
        As it announced itself.

    Raises
    ------
    EngineGone
        When it was killed; the sentence says to switch the amplifier off.

    """
    if engine.was_killed:
        raise EngineGone(f"The engine was killed. {SWITCH_OFF}")


def _only(chosen: list[AnyProgram]) -> AnyProgram:
    if len(chosen) > 1:
        raise EngineError(f"several programs drive a bench: {_named(chosen)}; name one with --pid")
    return chosen[0]


def _named(programs: Sequence[Program]) -> str:
    return ", ".join(f"{each.pid} ({each.what})" for each in programs)


def _refuses(address: EngineAddress) -> bool:
    """Whether nobody listens there any more: to be slow, or too busy to answer, is no refusal."""
    try:
        socket.create_connection((address.host, address.port), REFUSAL_S).close()
    except ConnectionRefusedError:
        return True
    except OSError:
        return False
    return False
