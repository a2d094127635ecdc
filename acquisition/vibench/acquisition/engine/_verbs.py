"""Everything that can be asked of an engine, each verb declared once: request, answer, permission.

A verb is a method of `EngineVerbs`. Its parameters are the request, checked on both sides of the wire; its
decorator says the word on the wire, how the answer travels, and the engine's states that permit it. Client
and server work by these declarations: a new verb is one more of them, and a method of the same name and
parameters on `RequestHandler`. Anyone who knows the engine's token may ask everything; each is answered at
once from what the engine holds.
"""

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import reduce, wraps
from inspect import Parameter, signature
from operator import or_
from pathlib import Path
from typing import Annotated, Any, Concatenate, Generic, Literal, ParamSpec, TypeVar, get_type_hints

import numpy as np
from pydantic import (
    AfterValidator,
    BaseModel,
    Field,
    NonNegativeFloat,
    NonNegativeInt,
    PositiveInt,
    TypeAdapter,
    create_model,
)

from ..campaign import AfterFailure, ChangedBench, ExistingRecordings
from ..check.admission import CheckRule
from ..host.toml_file import FrozenModel, validated
from ..plan import Campaign
from ..rig import KnobSheet, Rig
from ..stopping.stop import StopLevel
from ._published_state import SampleSlice
from ._status import (
    DRIVING,
    LONGEST_PATIENCE_S,
    VIEWER_PATIENCE_S,
    ArmedPlan,
    EngineState,
    EngineStatus,
    Supervision,
    TwinStatus,
    TwinSwitch,
)
from ._wire import Message


class CampaignRequest(FrozenModel):
    """A campaign, and how it is to be carried out."""

    campaign: Campaign
    folder: Path
    """Where its recordings go."""
    twin: TwinSwitch = TwinSwitch.OFF
    """Whether the live twin runs beside it; it does where a plan's ``on_changed_specimen`` needs it."""
    existing: ExistingRecordings = ExistingRecordings.REFUSE
    after_failure: AfterFailure = AfterFailure.STOP
    changed_bench: ChangedBench = ChangedBench.REFUSE
    check: CheckRule = CheckRule.FRESH
    attendance: Supervision | None = None
    """Whether somebody must look while it runs; what the engine was started for, if not given."""
    longest_patience_s: Annotated[float, Field(ge=VIEWER_PATIENCE_S, le=LONGEST_PATIENCE_S)] = (
        VIEWER_PATIENCE_S
    )
    """How long an attended drive far from every limit goes on while nobody looks [s]; see `patience_s`."""


P = ParamSpec("P")
A = TypeVar("A")
Model = TypeVar("Model", bound=BaseModel)


@dataclass(frozen=True)
class Answer(Generic[A]):
    """How an answer goes over the wire."""

    written: Callable[[A], Message]
    read: Callable[[Any, bytes], A]
    """From the parsed JSON text and the bytes behind it."""


@dataclass(frozen=True)
class Verb(Generic[A]):
    """One thing that can be asked of an engine."""

    word: str
    """On the wire, under ``ask``."""
    method: str
    """The request handler's method, and the client's."""
    request: type[FrozenModel]
    answer: Answer[A]
    states: tuple[EngineState, ...]
    """Where the engine must stand; empty: legal in every state, and never made to wait."""
    work_s: float
    """What is to be worked out before the answer may take so long [s]; 0: it is held ready."""

    def message(self, **arguments: object) -> Message:
        """Put a request on the wire."""
        request = validated(arguments, self.request, f"a request to {self.word}")
        return Message(request.model_dump_json().encode())


ARMING_S = 300.0
"""To hold a campaign of a hundred sweeps against the limits takes seconds, on a busy computer a minute."""
VERBS: dict[str, Verb[Any]] = {}
"""Every verb, by its word."""


def verb(
    word: str, answer: Answer[A], *states: EngineState, work_s: float = 0.0
) -> Callable[[Callable[Concatenate[Any, P], A]], Callable[Concatenate[Any, P], A]]:
    """Declare a verb by the signature of its call; the call then asks for it."""

    def declared(call: Callable[Concatenate[Any, P], A]) -> Callable[Concatenate[Any, P], A]:
        parameters = signature(call)
        row = Verb(word, call.__name__, _request(word, call), answer, states, work_s)
        VERBS[word] = row

        @wraps(call)
        def asking(client: Any, /, *args: P.args, **kwargs: P.kwargs) -> A:
            given = parameters.bind(client, *args, **kwargs)
            given.apply_defaults()
            _, *arguments = given.arguments.items()
            answered: A = client.ask(row, dict(arguments))
            return answered

        return asking

    return declared


def _request(word: str, call: Callable[..., object]) -> type[FrozenModel]:
    hints = get_type_hints(call, include_extras=True)
    _, *parameters = signature(call).parameters.values()
    fields: dict[str, Any] = {"ask": (Literal[word], word)}
    fields |= {
        each.name: (hints[each.name], ... if each.default is Parameter.empty else each.default)
        for each in parameters
    }
    return create_model(word, __base__=FrozenModel, **fields)


def _model(kind: type[Model]) -> Answer[Model]:
    return Answer(
        lambda told: Message(told.model_dump_json().encode()), lambda facts, _: kind.model_validate(facts)
    )


def _samples_written(newest_samples: SampleSlice) -> Message:
    facts = {
        "run_id": newest_samples.run_id,
        "first_sample": newest_samples.first_sample,
        "sample_rate_hz": newest_samples.sample_rate_hz,
        "shape": newest_samples.volts.shape,
    }
    return Message(json.dumps(facts).encode(), newest_samples.volts.astype("<f4").tobytes())


def _samples_read(facts: Mapping[str, Any], payload: bytes) -> SampleSlice:
    volts = np.frombuffer(payload, "<f4").reshape(facts["shape"])
    return SampleSlice(facts["run_id"], facts["first_sample"], facts["sample_rate_hz"], volts)


DONE: Answer[None] = Answer(lambda _: Message(b'{"ok": true}'), lambda _facts, _payload: None)
SAMPLES = Answer(_samples_written, _samples_read)
PLAN, STATUS, RIG = _model(ArmedPlan), _model(EngineStatus), _model(Rig)
REQUESTED = _model(CampaignRequest)


def _with_absolute_folder(request: CampaignRequest) -> CampaignRequest:
    return request.model_copy(update={"folder": request.folder.absolute()})


# The engine's process may stand in another folder than the process that asks.
AbsolutePath = Annotated[Path, AfterValidator(Path.absolute)]
AbsoluteRequest = Annotated[CampaignRequest, AfterValidator(_with_absolute_folder)]


class EngineVerbs:
    """The calls of an engine. `verb` replaces each body by one that asks; a subclass says how."""

    def ask(self, verb: Verb[A], arguments: Mapping[str, object]) -> A:
        """Send a request and give its answer."""
        raise NotImplementedError

    @verb("open", DONE, EngineState.CLOSED, EngineState.FAULT)
    def open(self, rig: Rig, confirmations: KnobSheet | None = None) -> None:
        """Open the bench of a rig; the status says when it is open.

        ``confirmations`` are the settings made by hand that somebody has seen; a virtual rig needs none.
        """

    @verb("close", DONE, EngineState.READY, EngineState.ARMED, EngineState.FAULT, EngineState.CLOSED)
    def close_bench(self) -> None:
        """Close the bench."""

    @verb("check", DONE, EngineState.READY)
    def check(self, folder: AbsolutePath = Path(), *, new_reference: bool = False) -> None:
        """Check the bench with a small sine; ``folder`` is where recordings will go.

        ``new_reference``: compare with no earlier check, since what has changed was meant.
        """

    @verb("arm", PLAN, EngineState.READY, EngineState.ARMED, work_s=ARMING_S)
    def arm_request(self, campaign_request: AbsoluteRequest) -> ArmedPlan:
        """Get ready to carry out a campaign, or be refused with the reasons."""
        raise NotImplementedError

    @verb("disarm", DONE)
    def disarm(self) -> None:
        """Take back what was armed."""

    @verb("start", DONE, EngineState.ARMED)
    def start(self) -> None:
        """Carry out what is armed."""

    @verb("stop", DONE)
    def stop(self, level: StopLevel, reason: str = "stopped by the operator") -> None:
        """Hold or end what runs, and disarm what is armed. Never refused."""

    @verb("resume", DONE)
    def resume(self) -> None:
        """Go on after a hold."""

    @verb("mark", DONE, *sorted(DRIVING))
    def mark(self, text: Annotated[str, Field(min_length=1, max_length=200)]) -> None:
        """Note an event at the next sample of the recording."""

    @verb("tell_change", DONE, *sorted(DRIVING))
    def tell_change(self, text: Annotated[str, Field(min_length=1, max_length=400)]) -> None:
        """Note that the specimen has changed; a run whose plan asks for it is ended."""

    @verb("rig", RIG)
    def open_rig(self) -> Rig:
        """Return the configuration of the open bench."""
        raise NotImplementedError

    @verb("request", REQUESTED)
    def carried_request(self) -> CampaignRequest:
        """Return the campaign that was started last, and how: for a viewer that did not arm it."""
        raise NotImplementedError

    @verb("twin", DONE)
    def turn_twin(self, switch: TwinSwitch) -> None:
        """Start or end the live twin beside what runs."""

    @verb("tell_twin", DONE)
    def tell_twin(self, told: TwinStatus) -> None:
        """Show what the live twin tells."""

    @verb("status", STATUS)
    def status_since(self, known_rows: int = -1) -> EngineStatus:
        """Where the engine stands, without its rows if ``known_rows`` is still their number."""
        raise NotImplementedError

    @verb("beat", DONE)
    def beat(self, still_s: NonNegativeFloat = 0.0) -> None:
        """Say that somebody is there, and want nothing; ``still_s``: for how long the window stood still."""

    @verb("look", SAMPLES)
    def look(self, since_sample: NonNegativeInt = 0, *, most: PositiveInt) -> SampleSlice:
        """Return the newest samples of the run: from ``since_sample`` on, at most ``most`` a channel."""
        raise NotImplementedError

    @verb("shutdown", DONE)
    def shutdown(self) -> None:
        """Ramp down, silence everything, end the process."""


_REQUESTS: Any = reduce(or_, (row.request for row in VERBS.values()))
REQUEST: TypeAdapter[FrozenModel] = TypeAdapter(Annotated[_REQUESTS, Field(discriminator="ask")])
"""Reads a request from JSON, or refuses it."""
