"""Asking an engine, from a window, a command or a script: plain blocking calls that return at once."""

import socket
from collections.abc import Mapping
from pathlib import Path
from threading import Lock
from typing import TypeVar

from ..campaign import ExistingRecordings
from ..host.chosen import chosen
from ..host.closed_on_leaving import ClosedOnLeaving
from ..plan import Campaign
from ._address import EngineAddress
from ._campaign_request import CampaignRequest
from ._connection import PATIENCE_S, connected, exchanged
from ._state import ConnectionRole
from ._status import ArmedPlan, EngineStatus, RowStatus
from ._verbs import EngineVerbs, Verb

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
