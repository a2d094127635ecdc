"""From a request as it came over the wire to the answer that goes back."""

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ValidationError

from ..errors import AcquisitionError
from ..stopping import Cause, StopRequest
from . import _requests as ask
from ._request_handler import Desk
from ._sample_buffer import Glance
from ._wire import Message

DONE = Message(b'{"ok": true}')


def answered(desk: Desk, message: Message) -> Message:
    """Do what a message asks for; what is refused comes back as one sentence."""
    try:
        request = ask.REQUEST.validate_json(message.text)
        return _answer(desk, request)
    except ValidationError as error:
        detail = error.errors()[0]
        where = ".".join(str(part) for part in detail["loc"])
        return refused(
            f"what was asked is not understood ({where}: {detail['msg']}); nothing was done", error
        )
    except AcquisitionError as error:
        return refused(str(error), error)


def refused(sentence: str, error: Exception) -> Message:
    """Say no."""
    return Message(json.dumps({"refused": sentence, "kind": type(error).__name__}).encode())


def _answer(desk: Desk, request: ask.Request) -> Message:
    match request:
        case ask.Status(known_rows=known):
            status = desk.status()
            is_known = status.rows_number == known
            return _model(status.model_copy(update={"rows": ()}) if is_known else status)
        case ask.Look(since_sample=since, most=most):
            return _glance(desk.look(since, most))
        case ask.Arm(orders=orders):
            return _model(desk.arm(orders))
        case _:
            _ORDERS[type(request)](desk, request)
            return DONE


_ORDERS: Mapping[type, Callable[[Desk, Any], None]] = {
    ask.Hello: lambda _desk, _order: None,
    ask.Beat: lambda _desk, _order: None,
    ask.Open: lambda desk, order: desk.open(order.rig, order.confirmations),
    ask.Close: lambda desk, _order: desk.close(),
    ask.Check: lambda desk, order: desk.check(Path(order.folder)),
    ask.Disarm: lambda desk, _order: desk.disarm(),
    ask.Start: lambda desk, _order: desk.start(),
    ask.Stop: lambda desk, order: desk.stop(StopRequest(Cause.OPERATOR, order.level, order.reason)),
    ask.Resume: lambda desk, _order: desk.resume(),
    ask.Mark: lambda desk, order: desk.mark(order.text),
    ask.Shutdown: lambda desk, _order: desk.shutdown(Cause.OPERATOR, "the engine was told to end"),
}
"""What is done, and answered with no more than that it was."""


def _model(model: BaseModel) -> Message:
    return Message(model.model_dump_json().encode())


def _glance(glance: Glance) -> Message:
    facts = {
        "run_id": glance.run_id,
        "first_sample": glance.first_sample,
        "sample_rate_hz": glance.sample_rate_hz,
        "shape": glance.volts.shape,
    }
    return Message(json.dumps(facts).encode(), glance.volts.astype("<f4").tobytes())
