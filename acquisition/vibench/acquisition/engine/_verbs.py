"""All requests to an engine, each verb declared once: request, answer, permitted states.

A verb is a method of `EngineVerbs`. Its parameters are the request, checked on both sides of the connection;
its decorator gives the word in the message, the form of the answer, and the engine's states that permit the
request. Client and server use these declarations: a new verb needs a method here, and a method with the same
name and parameters in `RequestHandler`. The engine's token permits all requests.
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
from ..host.toml_file import FrozenModel, validate
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
    """A campaign, and the options with which it is run."""

    campaign: Campaign
    folder: Path
    """Folder for the recordings of the campaign."""
    twin: TwinSwitch = TwinSwitch.OFF
    """Whether the live twin runs with the campaign; it always runs for a plan with ``on_changed_specimen =
    "stop"``."""
    existing: ExistingRecordings = ExistingRecordings.REFUSE
    after_failure: AfterFailure = AfterFailure.STOP
    changed_bench: ChangedBench = ChangedBench.REFUSE
    check: CheckRule = CheckRule.FRESH
    attendance: Supervision | None = None
    """Whether the run needs the presence of a viewer; None uses the setting from the start of the engine."""
    longest_patience_s: Annotated[float, Field(ge=VIEWER_PATIENCE_S, le=LONGEST_PATIENCE_S)] = (
        VIEWER_PATIENCE_S
    )
    """Time for which an attended drive far from all limits runs without requests [s]; see `patience_s`."""


P = ParamSpec("P")
A = TypeVar("A")
Model = TypeVar("Model", bound=BaseModel)


@dataclass(frozen=True)
class Answer(Generic[A]):
    """Conversion of an answer to a message and back."""

    written: Callable[[A], Message]
    read: Callable[[Any, bytes], A]
    """Function that returns an answer's value from its parsed JSON text and the bytes after that text."""


@dataclass(frozen=True)
class Verb(Generic[A]):
    """One kind of request to an engine."""

    word: str
    """Value of the key ``ask`` in the message."""
    method: str
    """Name of the verb's method in the request handler and in the client."""
    request: type[FrozenModel]
    answer: Answer[A]
    states: tuple[EngineState, ...]
    """Engine states that permit the request; if empty, it is allowed in every state and never delayed."""
    work_s: float
    """Longest time to compute the answer [s]; 0 if the answer is ready at once."""

    def message(self, **arguments: object) -> Message:
        """Return the message that carries a request."""
        request = validate(arguments, self.request, f"a request to {self.word}")
        return Message(request.model_dump_json().encode())


ARMING_S = 300.0
"""Longest time for arming [s]. Checking 100 sweeps takes seconds, or a minute on a busy computer."""
VERBS: dict[str, Verb[Any]] = {}
"""All verbs, keyed by their word in the message."""


def verb(
    word: str, answer: Answer[A], *states: EngineState, work_s: float = 0.0
) -> Callable[[Callable[Concatenate[Any, P], A]], Callable[Concatenate[Any, P], A]]:
    """Return a decorator that declares a method as a verb, so that calling the method sends the request."""

    def declare(call: Callable[Concatenate[Any, P], A]) -> Callable[Concatenate[Any, P], A]:
        parameters = signature(call)
        row = Verb(word, call.__name__, _request(word, call), answer, states, work_s)
        VERBS[word] = row

        @wraps(call)
        def send_request(client: Any, /, *args: P.args, **kwargs: P.kwargs) -> A:
            given = parameters.bind(client, *args, **kwargs)
            given.apply_defaults()
            _, *arguments = given.arguments.items()
            answered: A = client.ask(row, dict(arguments))
            return answered

        return send_request

    return declare


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
        lambda value: Message(value.model_dump_json().encode()), lambda facts, _: kind.model_validate(facts)
    )


def _write_samples(newest_samples: SampleSlice) -> Message:
    facts = {
        "run_id": newest_samples.run_id,
        "first_sample": newest_samples.first_sample,
        "sample_rate_hz": newest_samples.sample_rate_hz,
        "shape": newest_samples.volts.shape,
    }
    return Message(json.dumps(facts).encode(), newest_samples.volts.astype("<f4").tobytes())


def _read_samples(facts: Mapping[str, Any], payload: bytes) -> SampleSlice:
    volts = np.frombuffer(payload, "<f4").reshape(facts["shape"])
    return SampleSlice(facts["run_id"], facts["first_sample"], facts["sample_rate_hz"], volts)


DONE: Answer[None] = Answer(lambda _: Message(b'{"ok": true}'), lambda _facts, _payload: None)
SAMPLES = Answer(_write_samples, _read_samples)
PLAN, STATUS, RIG = _model(ArmedPlan), _model(EngineStatus), _model(Rig)
REQUESTED = _model(CampaignRequest)


def _with_absolute_folder(request: CampaignRequest) -> CampaignRequest:
    return request.model_copy(update={"folder": request.folder.absolute()})


# The engine's process may have another working folder than the client, so send an absolute path.
AbsolutePath = Annotated[Path, AfterValidator(Path.absolute)]
AbsoluteRequest = Annotated[CampaignRequest, AfterValidator(_with_absolute_folder)]


class EngineVerbs:
    """The requests to an engine. `verb` replaces each body by a call of `ask`, which a subclass defines."""

    def ask(self, verb: Verb[A], arguments: Mapping[str, object]) -> A:
        """Send a request and return its answer."""
        raise NotImplementedError

    @verb("open", DONE, EngineState.CLOSED, EngineState.FAULT)
    def open(self, rig: Rig, confirmations: KnobSheet | None = None) -> None:
        """Open the bench of a rig; the status shows when it is open.

        ``confirmations`` lists the manual settings that the operator confirmed; a virtual rig needs none.
        """

    @verb("close", DONE, EngineState.READY, EngineState.ARMED, EngineState.FAULT, EngineState.CLOSED)
    def close_bench(self) -> None:
        """Close the bench."""

    @verb("check", DONE, EngineState.READY)
    def check(self, folder: AbsolutePath = Path(), *, new_reference: bool = False) -> None:
        """Check the bench with a small sine, and the free disk space of ``folder``.

        ``new_reference``: do not compare with an earlier check, because the bench was changed on purpose.
        """

    @verb("arm", PLAN, EngineState.READY, EngineState.ARMED, work_s=ARMING_S)
    def arm_request(self, campaign_request: AbsoluteRequest) -> ArmedPlan:
        """Prepare a campaign and return its plan, or refuse the campaign with the reasons."""
        raise NotImplementedError

    @verb("disarm", DONE)
    def disarm(self) -> None:
        """Disarm the campaign, so that it cannot be started."""

    @verb("start", DONE, EngineState.ARMED)
    def start(self) -> None:
        """Start the armed campaign."""

    @verb("stop", DONE)
    def stop(self, level: StopLevel, reason: str = "stopped by the operator") -> None:
        """Pause or end the run, and disarm an armed campaign; only a pause can be refused."""

    @verb("resume", DONE)
    def resume(self) -> None:
        """Continue a paused run."""

    @verb("mark", DONE, *sorted(DRIVING))
    def mark(self, text: Annotated[str, Field(min_length=1, max_length=200)]) -> None:
        """Write an event at the next sample of the recording."""

    @verb("tell_change", DONE, *sorted(DRIVING))
    def note_change(self, text: Annotated[str, Field(min_length=1, max_length=400)]) -> None:
        """Report that the specimen has changed; a run with ``on_changed_specimen = "stop"`` ends."""

    @verb("rig", RIG)
    def open_rig(self) -> Rig:
        """Return the configuration of the open bench."""
        raise NotImplementedError

    @verb("request", REQUESTED)
    def last_request(self) -> CampaignRequest:
        """Return the last started campaign with its options, for a viewer that did not arm it."""
        raise NotImplementedError

    @verb("twin", DONE)
    def turn_twin(self, switch: TwinSwitch) -> None:
        """Start or end the live twin."""

    @verb("tell_twin", DONE)
    def publish_twin(self, told: TwinStatus) -> None:
        """Publish the live twin's report."""

    @verb("status", STATUS)
    def status_since(self, known_rows: int = -1) -> EngineStatus:
        """Return the engine's status, without its ``rows`` if ``known_rows`` equals its ``rows_number``."""
        raise NotImplementedError

    @verb("beat", DONE)
    def heartbeat(self, still_s: NonNegativeFloat = 0.0) -> None:
        """Report that the viewer is present, and how long its window has been blocked (``still_s`` [s])."""

    @verb("look", SAMPLES)
    def look(self, since_sample: NonNegativeInt = 0, *, most: PositiveInt) -> SampleSlice:
        """Return the newest samples of the run: from ``since_sample`` on, at most ``most`` per channel."""
        raise NotImplementedError

    @verb("shutdown", DONE)
    def shutdown(self) -> None:
        """Ramp the drive down, silence all outputs, and end the process."""


_REQUESTS: Any = reduce(or_, (row.request for row in VERBS.values()))
REQUEST: TypeAdapter[FrozenModel] = TypeAdapter(Annotated[_REQUESTS, Field(discriminator="ask")])
"""Validator of the JSON text of a request."""
