"""All requests to an engine, each verb declared once: request, answer, permitted states.

A verb is a method of `RequestHandler`. Its parameters are the request, checked on both sides of the
connection, and its return value is the answer; its decorator gives the word in the message and the engine's
states that permit the request. `EngineClient` sends the request through a method made by `sent`. The engine's
token permits all requests.
"""

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import wraps
from inspect import Parameter, signature
from pathlib import Path
from typing import Annotated, Any, Concatenate, Literal, ParamSpec, TypeVar, get_type_hints

import numpy as np
from pydantic import AfterValidator, BaseModel, Field, create_model

from ..campaign import AfterFailure, ChangedBench, ExistingRecordings
from ..check.admission import CheckRule
from ..host.toml_file import FrozenModel, validate
from ..plan import Campaign
from ._published_state import SampleSlice
from ._status import (
    LONGEST_PATIENCE_S,
    VIEWER_PATIENCE_S,
    EngineState,
    Supervision,
    TwinSwitch,
)
from ._wire import Message


class CampaignRequest(FrozenModel):
    """A campaign, and the options with which it is run."""

    campaign: Campaign
    folder: Path
    """Folder for the recordings of the campaign."""
    twin: TwinSwitch = TwinSwitch.OFF
    """Whether the live twin runs with the campaign; the twin always runs for a plan with
    ``on_changed_specimen = "stop"``."""
    existing: ExistingRecordings = ExistingRecordings.REFUSE
    after_failure: AfterFailure = AfterFailure.STOP
    changed_bench: ChangedBench = ChangedBench.REFUSE
    check: CheckRule = CheckRule.FRESH
    attendance: Supervision | None = None
    """Whether the run needs the presence of a viewer; None uses the setting from the start of the engine."""
    longest_patience_s: Annotated[float, Field(ge=VIEWER_PATIENCE_S, le=LONGEST_PATIENCE_S)] = (
        VIEWER_PATIENCE_S
    )
    """Time for which an attended run far from all limits continues without requests [s]; see `patience_s`."""


P = ParamSpec("P")
A = TypeVar("A")


@dataclass(frozen=True)
class Verb:
    """One kind of request to an engine."""

    word: str
    """Value of the key ``ask`` in the message."""
    call: Callable[..., Any]
    """Method of the request handler that carries out the request."""
    request: type[FrozenModel]
    returns: type[Any]
    """Class of the answer."""
    states: tuple[EngineState, ...]
    """Engine states that permit the request; if none, the request is always allowed and never delayed."""
    work_s: float
    """Longest time to compute the answer [s]; 0 if the answer is ready at once."""

    def message(self, **arguments: object) -> Message:
        """Return the message that carries a request."""
        request = validate(arguments, self.request, f"a request to {self.word}")
        return Message(request.model_dump_json().encode())

    def answer(self, facts: Mapping[str, Any], payload: bytes) -> Any:
        """Return the answer in a message, from its parsed JSON text and the bytes after that text."""
        if self.returns is SampleSlice:
            volts = np.frombuffer(payload, "<f4").reshape(facts["shape"])
            return SampleSlice(facts["run_id"], facts["first_sample"], facts["sample_rate_hz"], volts)
        return self.returns.model_validate(facts) if issubclass(self.returns, BaseModel) else None


def answer_message(answer: BaseModel | SampleSlice | None) -> Message:
    """Return the message that carries an answer; None confirms a request without a value."""
    if answer is None:
        return Message(b'{"ok": true}')
    if isinstance(answer, BaseModel):
        return Message(answer.model_dump_json().encode())
    facts = {
        "run_id": answer.run_id,
        "first_sample": answer.first_sample,
        "sample_rate_hz": answer.sample_rate_hz,
        "shape": answer.volts.shape,
    }
    return Message(json.dumps(facts).encode(), answer.volts.astype("<f4").tobytes())


ARMING_S = 300.0
"""Longest time for arming [s]. Checking 100 sweeps takes seconds, or a minute on a busy computer."""
VERBS: dict[str, Verb] = {}
"""All verbs, keyed by their word in the message."""


def verb(word: str, *states: EngineState, work_s: float = 0.0) -> Callable[[Callable[P, A]], Callable[P, A]]:
    """Return a decorator that declares a method of the request handler as a verb."""

    def declare(call: Callable[P, A]) -> Callable[P, A]:
        hints = get_type_hints(call, include_extras=True)
        _, *parameters = signature(call).parameters.values()
        fields: dict[str, Any] = {"ask": (Literal[word], word)}
        fields |= {
            each.name: (hints[each.name], ... if each.default is Parameter.empty else each.default)
            for each in parameters
        }
        request = create_model(word, __base__=FrozenModel, **fields)
        VERBS[word] = Verb(word, call, request, hints["return"], states, work_s)
        return call

    return declare


def sent(call: Callable[Concatenate[Any, P], A]) -> Callable[Concatenate[Any, P], A]:
    """Return the method of a client that sends the request which ``call`` carries out in the engine."""
    verb, parameters = next(each for each in VERBS.values() if each.call is call), signature(call)

    @wraps(call)
    def send_request(client: Any, /, *args: P.args, **kwargs: P.kwargs) -> A:
        given = parameters.bind(client, *args, **kwargs)
        given.apply_defaults()
        _, *arguments = given.arguments.items()
        answered: A = client.ask(verb, dict(arguments))
        return answered

    return send_request


def _with_absolute_folder(request: CampaignRequest) -> CampaignRequest:
    return request.model_copy(update={"folder": request.folder.absolute()})


# Send absolute paths, because the engine's working folder may differ from the client's.
AbsolutePath = Annotated[Path, AfterValidator(Path.absolute)]
AbsoluteRequest = Annotated[CampaignRequest, AfterValidator(_with_absolute_folder)]
