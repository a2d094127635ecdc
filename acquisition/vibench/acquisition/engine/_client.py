"""Asking an engine, from a window, a command or a script: plain blocking calls that return at once."""

import json
import socket
from collections.abc import Mapping
from pathlib import Path
from threading import Lock
from typing import Any, Literal, TypeVar

from vibench.stop_files import SWITCH_OFF

from .. import errors
from ..campaign import ExistingRecordings
from ..errors import AcquisitionError
from ..host.beside import ClosedOnLeaving
from ..host.chosen import chosen
from ..host.toml_file import FrozenModel
from ..plan import Campaign
from ._announcement import EngineAddress
from ._status import ArmedPlan, ConnectionRole, EngineStatus, RowStatus
from ._verbs import CampaignRequest, EngineVerbs, Verb
from ._wire import ANSWERS, EngineError, EngineGone, EngineSilent, Message, receive, send

PATIENCE_S = 5.0
"""How long an answer may take; the engine answers from what it holds, in milliseconds [s]."""


class Hello(FrozenModel):
    """The first thing said on every connection."""

    ask: Literal["hello"] = "hello"
    token: str
    role: ConnectionRole = ConnectionRole.VISITING


def connected(address: EngineAddress, role: ConnectionRole, patience_s: float = PATIENCE_S) -> socket.socket:
    """Connect to a running engine and be let in; no answer on the connection may take ``patience_s``."""
    hello = Hello(token=address.token, role=role)
    try:
        connection = socket.create_connection((address.host, address.port), patience_s)
    except TimeoutError as error:
        raise _silent(patience_s) from error
    except OSError as error:
        raise EngineGone(
            f"no engine answers at {address.host}:{address.port} ({error}); start one, or see whether it "
            "has ended"
        ) from error
    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    try:
        exchanged(connection, Message(hello.model_dump_json().encode()))
    except AcquisitionError:
        connection.close()
        raise
    return connection


def exchanged(
    connection: socket.socket, request: Message, work_s: float = 0.0
) -> tuple[dict[str, Any], bytes]:
    """Send a request and wait for its answer: the parsed text, and the bytes behind it.

    ``work_s`` [s] is what the answer may take beyond the patience of the connection.

    Raises
    ------
    EngineSilent
        When no answer comes in time; the connection is closed then.
    EngineGone
        When the connection has ended; it is closed then.
    AcquisitionError
        What the engine refuses with.

    """
    usual_s = connection.gettimeout()
    patience_s = (usual_s or PATIENCE_S) + work_s
    try:
        send(connection, request)
        connection.settimeout(patience_s)
        answer = receive(connection, ANSWERS)
        connection.settimeout(usual_s)
    except TimeoutError as error:
        # An answer that comes late must not be taken for that to the next question.
        connection.close()
        raise _silent(patience_s) from error
    except OSError as error:
        connection.close()
        raise EngineGone(
            f"the engine was killed, or closed this connection ({error}). {SWITCH_OFF}"
        ) from error
    facts = json.loads(answer.text)
    if "refused" in facts:
        raise _refusal(facts["kind"], facts["refused"])
    return facts, answer.payload


def _silent(patience_s: float) -> EngineSilent:
    return EngineSilent(
        f"the engine does not answer within {patience_s:g} s; its process hangs, or was stopped. What it "
        "drives may go on: 'vibench stop' leaves a stop that it obeys when it comes back; in an emergency "
        "switch the amplifier off by hand"
    )


def _refusal(kind: str, sentence: str) -> AcquisitionError:
    """Raise here what was raised there, as far as it is one of ours."""
    known = getattr(errors, kind, None)
    if isinstance(known, type) and issubclass(known, AcquisitionError):
        return known(sentence)
    return EngineError(sentence)


Answer = TypeVar("Answer")


class EngineClient(EngineVerbs, ClosedOnLeaving):
    """A connection to an engine.

    Asking anything over an attending connection tells the engine that somebody is there: an attended
    run goes on only while something is asked at least twice a second. Each method raises `EngineGone`
    when the engine's process has ended, and the engine's own `AcquisitionError` when it refuses.
    """

    def __init__(self, connection: socket.socket) -> None:
        self._connection = connection
        self._asking = Lock()
        self._rows: tuple[int, tuple[RowStatus, ...]] = (-1, ())

    @classmethod
    def attach(
        cls,
        address: EngineAddress,
        role: ConnectionRole | str = ConnectionRole.VISITING,
        patience_s: float = PATIENCE_S,
    ) -> "EngineClient":
        """Connect to a running engine, for a look or to attend to its run.

        Raises
        ------
        EngineSilent
            When no answer comes within ``patience_s`` [s], now or later.
        EngineGone
            When nobody listens there.

        """
        return cls(connected(address, chosen(ConnectionRole, role), patience_s))

    def status(self) -> EngineStatus:
        """Where the engine stands."""
        number, rows = self._rows
        status = self.status_since(number)
        if status.rows_number == number:
            return status.model_copy(update={"rows": rows})
        self._rows = (status.rows_number, status.rows)
        return status

    def arm(
        self, campaign: Campaign, folder: Path, existing: ExistingRecordings | str = ExistingRecordings.REFUSE
    ) -> ArmedPlan:
        """Get ready to carry out a campaign; `arm_request` takes all that can be said."""
        return self.arm_request(
            CampaignRequest(campaign=campaign, folder=folder, existing=chosen(ExistingRecordings, existing))
        )

    def close(self) -> None:
        """End the connection; the engine stays. Legal at any time."""
        self._connection.close()

    def ask(self, verb: Verb[Answer], arguments: Mapping[str, object]) -> Answer:
        """Send a request and wait for its answer."""
        request = verb.message(**arguments)
        with self._asking:
            return verb.answer.read(*exchanged(self._connection, request, verb.work_s))
