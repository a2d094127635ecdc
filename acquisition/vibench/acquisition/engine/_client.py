"""Asking an engine, from a window, a command or a script: plain blocking calls that return at once."""

import json
import socket
from pathlib import Path
from threading import Lock
from types import TracebackType
from typing import Any, Self, TypeVar

import numpy as np
from pydantic import BaseModel

from .. import errors
from ..campaign import ExistingRecordings
from ..errors import AcquisitionError
from ..plan import Campaign
from ..rig import KnobSheet, Rig
from ..stopping import StopLevel
from . import _requests as ask
from ._address import EngineAddress
from ._errors import EngineError, EngineGone
from ._requests import CampaignRequest
from ._sample_buffer import SampleSlice
from ._state import ConnectionRole
from ._status import ArmedPlan, EngineStatus, RowStatus
from ._wire import Message, receive, send

PATIENCE_S = 5.0
"""How long an answer may take; the engine answers from what it holds, in milliseconds [s]."""
Answer = TypeVar("Answer", bound=BaseModel)


class EngineClient:
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
    def attach(cls, address: EngineAddress, role: ConnectionRole = ConnectionRole.VISITING) -> "EngineClient":
        """Connect to a running engine, for a look or to attend to its run."""
        try:
            connection = socket.create_connection((address.host, address.port), PATIENCE_S)
        except OSError as error:
            raise EngineGone(
                f"no engine answers at {address.host}:{address.port} ({error}); start one, or see whether it "
                "has ended"
            ) from error
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        client = cls(connection)
        try:
            client._do(ask.Hello(token=address.token, role=role))
        except AcquisitionError:
            client.close()
            raise
        return client

    def status(self) -> EngineStatus:
        """Where the engine stands."""
        number, rows = self._rows
        status = self._told(ask.Status(known_rows=number), EngineStatus)
        if status.rows_number == number:
            return status.model_copy(update={"rows": rows})
        self._rows = (status.rows_number, status.rows)
        return status

    def look(self, since_sample: int, most: int) -> SampleSlice:
        """Give the newest samples of the run: from ``since_sample`` on, at most ``most`` a channel."""
        facts, payload = self._asked(ask.Look(since_sample=since_sample, most=most))
        volts = np.frombuffer(payload, "<f4").reshape(facts["shape"])
        return SampleSlice(facts["run_id"], facts["first_sample"], facts["sample_rate_hz"], volts)

    def open(self, rig: Rig, confirmations: KnobSheet | None = None) -> None:
        """Open the bench of a rig; the status says when it is open."""
        self._do(ask.Open(rig=rig, confirmations=confirmations))

    def close_bench(self) -> None:
        """Close the bench."""
        self._do(ask.Close())

    def check(self, folder: Path = Path()) -> None:
        """Check the bench; the status will hold what was found."""
        self._do(ask.Check(folder=str(folder.absolute())))

    def arm(
        self, campaign: Campaign, folder: Path, existing: ExistingRecordings = ExistingRecordings.REFUSE
    ) -> ArmedPlan:
        """Get ready to carry out a campaign, or be refused with the reasons."""
        return self.arm_request(CampaignRequest(campaign=campaign, folder=folder, existing=existing))

    def arm_request(self, campaign_request: CampaignRequest) -> ArmedPlan:
        """Get ready as `arm` does, with everything said that can be said."""
        absolute = campaign_request.model_copy(update={"folder": campaign_request.folder.absolute()})
        return self._told(ask.Arm(campaign_request=absolute), ArmedPlan)

    def disarm(self) -> None:
        """Take back what was armed."""
        self._do(ask.Disarm())

    def start(self) -> None:
        """Carry out what is armed."""
        self._do(ask.Start())

    def stop(self, level: StopLevel, reason: str = "stopped by the operator") -> None:
        """Hold or end what runs."""
        self._do(ask.Stop(level=level, reason=reason))

    def resume(self) -> None:
        """Go on after a hold."""
        self._do(ask.Resume())

    def mark(self, text: str) -> None:
        """Note an event at the next sample of the recording."""
        self._do(ask.Mark(text=text))

    def shutdown(self) -> None:
        """Let the engine ramp down, silence everything and end."""
        self._do(ask.Shutdown())

    def close(self) -> None:
        """End the connection; the engine stays. Legal at any time."""
        self._connection.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _do(self, request: ask.Request) -> None:
        self._asked(request)

    def _told(self, request: ask.Request, kind: type[Answer]) -> Answer:
        facts, _ = self._asked(request)
        return kind.model_validate(facts)

    def _asked(self, request: ask.Request) -> tuple[dict[str, Any], bytes]:
        try:
            with self._asking:
                send(self._connection, Message(request.model_dump_json().encode()))
                answer = receive(self._connection)
        except OSError as error:
            # An answer that comes late must not be taken for that to the next question.
            self._connection.close()
            raise EngineGone(
                f"the engine does not answer ({error}); its process has ended or hangs. What it drove is "
                "silent if it could ramp down: look at the bench"
            ) from error
        facts = json.loads(answer.text)
        if "refused" in facts:
            raise _refusal(facts["kind"], facts["refused"])
        return facts, answer.payload


def _refusal(kind: str, sentence: str) -> AcquisitionError:
    """Raise here what was raised there, as far as it is one of ours."""
    known = getattr(errors, kind, None)
    if isinstance(known, type) and issubclass(known, AcquisitionError):
        return known(sentence)
    return EngineError(sentence)
