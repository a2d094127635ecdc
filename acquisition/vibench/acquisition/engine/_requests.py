"""What can be asked of an engine. Each is answered at once from what the engine holds; nothing waits.

What an engine is to carry out, and how.
"""

from pathlib import Path
from typing import Annotated, Literal, TypeAlias

from pydantic import Field, NonNegativeInt, PositiveInt, TypeAdapter

from ..campaign import AfterFailure, ChangedBench, ExistingRecordings
from ..check import CheckRule
from ..host import FrozenModel
from ..plan import Campaign
from ..rig import KnobSheet, Rig
from ..stopping import StopLevel
from ._state import ConnectionRole


class CampaignRequest(FrozenModel):
    """A campaign, and how it is to be carried out."""

    campaign: Campaign
    folder: Path
    """Where its recordings go."""
    existing: ExistingRecordings = ExistingRecordings.REFUSE
    after_failure: AfterFailure = AfterFailure.STOP
    changed_bench: ChangedBench = ChangedBench.REFUSE
    check: CheckRule = CheckRule.FRESH


class Hello(FrozenModel):
    """The first thing said on every connection."""

    ask: Literal["hello"] = "hello"
    token: str
    role: ConnectionRole = ConnectionRole.VISITING


class Open(FrozenModel):
    """Open the bench of a rig."""

    ask: Literal["open"] = "open"
    rig: Rig
    confirmations: KnobSheet | None = None
    """Settings made by hand that somebody has seen; a virtual rig needs none."""


class Close(FrozenModel):
    """Close the bench."""

    ask: Literal["close"] = "close"


class Check(FrozenModel):
    """Check the bench with a small sine."""

    ask: Literal["check"] = "check"
    folder: str = "."
    """Where recordings will go."""


class Arm(FrozenModel):
    """Get ready to carry out a campaign, or refuse it with reasons."""

    ask: Literal["arm"] = "arm"
    campaign_request: CampaignRequest


class Disarm(FrozenModel):
    """Take back what was armed."""

    ask: Literal["disarm"] = "disarm"


class Start(FrozenModel):
    """Carry out what is armed."""

    ask: Literal["start"] = "start"


class Stop(FrozenModel):
    """Hold or end what runs. Legal in every state."""

    ask: Literal["stop"] = "stop"
    level: StopLevel
    reason: str = "stopped by the operator"


class Resume(FrozenModel):
    """Go on after a hold."""

    ask: Literal["resume"] = "resume"


class Mark(FrozenModel):
    """Note an event at the next sample of the recording."""

    ask: Literal["mark"] = "mark"
    text: Annotated[str, Field(min_length=1, max_length=200)]


class Status(FrozenModel):
    """Ask where the engine stands."""

    ask: Literal["status"] = "status"
    known_rows: int = -1
    """Number of the rows that the viewer has; the answer leaves them out if it is still the same."""


class Beat(FrozenModel):
    """Say that somebody is there, and want nothing."""

    ask: Literal["beat"] = "beat"


class Look(FrozenModel):
    """Ask for the newest samples of the run."""

    ask: Literal["look"] = "look"
    since_sample: NonNegativeInt = 0
    most: PositiveInt


class Shutdown(FrozenModel):
    """Ramp down, silence everything, end the process."""

    ask: Literal["shutdown"] = "shutdown"


Request: TypeAlias = Annotated[
    Hello
    | Open
    | Close
    | Check
    | Arm
    | Disarm
    | Start
    | Stop
    | Resume
    | Mark
    | Status
    | Beat
    | Look
    | Shutdown,
    Field(discriminator="ask"),
]

REQUEST: TypeAdapter[Request] = TypeAdapter(Request)
"""Reads a request from JSON, or refuses it."""
