"""A viewer's end of a connection: let in with the token, then one answer for each request."""

import json
import socket
from typing import Any, Literal

from vibench.stop_files import SWITCH_OFF

from .. import errors
from ..errors import AcquisitionError
from ..host.toml_file import FrozenModel
from ._address import EngineAddress
from ._errors import EngineError, EngineGone, EngineSilent
from ._state import ConnectionRole
from ._wire import ANSWERS, Message, receive, send

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
