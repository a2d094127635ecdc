"""gRPC server of the simulated DAQmx system, for any nidaqmx program."""

import hmac
import secrets
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from functools import partial
from typing import Any, Self

import grpc
from nidaqmx._stubs import nidaqmx_pb2
from nidaqmx.error_codes import DAQmxErrors

from vibench.acquisition import ConfigurationError
from vibench.acquisition.rig import TOKEN_KEY, TOKEN_VARIABLE

from ..world.world import World
from .attributes import SERVICE, attribute_calls
from .calls import CALLS, EVENTS, TASK_CALLS, DaqmxSystem, Fields, Listener, TaskCall
from .data_calls import DATA_CALLS
from .devices import Catalogue
from .errors import DaqmxRefusal, Faults, Unavailable
from .rig import FAILED_CALL_S, OnDemandPace, Pace, Rig

LOOPBACK_HOSTS = frozenset({"127.0.0.1", "localhost", "[::1]"})


def token_for(address: str) -> str | None:
    """Return a token for a server at ``"host:port"``; None on loopback, which only this computer reaches."""
    host = address.rpartition(":")[0]
    return None if host in LOOPBACK_HOSTS else secrets.token_urlsafe(24)


class TokenCheck(grpc.ServerInterceptor):  # type: ignore[misc] # grpc ships without types
    """Interceptor that rejects calls without the server's token."""

    def __init__(self, token: str) -> None:
        self._token = token

    def intercept_service(self, continuation: Callable[[Any], Any], details: Any) -> Any:
        """Pass a call on if it has the token, or reject it."""
        given = dict(details.invocation_metadata).get(TOKEN_KEY, "")
        if hmac.compare_digest(str(given).encode(), self._token.encode()):
            return continuation(details)
        reason = (
            f"this rig is served with a token: set {TOKEN_VARIABLE} to the token 'vibench serve-rig' printed"
        )
        return grpc.unary_unary_rpc_method_handler(
            lambda _, context: context.abort(grpc.StatusCode.UNAUTHENTICATED, reason)
        )


LOOPBACK = "127.0.0.1:0"
"""Default address: any free port, open only to this computer, because the server has no passwords."""

LAST_PORT = 65_535
_WORKERS = 64
"""Number of threads; each blocking read and each event listener needs one thread."""

LONGEST_REQUEST_BYTES = 64_000_000
"""Largest request: eight million output samples, or 40 s at the highest rate."""
_NO_LIMIT = -1
_OPTIONS = (
    ("grpc.max_receive_message_length", LONGEST_REQUEST_BYTES),
    ("grpc.max_send_message_length", _NO_LIMIT),
    ("grpc.so_reuseport", 0),  # a second server on the same port must fail
)

Handler = Callable[[Any, grpc.ServicerContext], Any]


class DaqServer:
    """Server of the simulated DAQmx system; leaving its context deletes every task and ends every thread.

    Parameters
    ----------
    world
        The signals at the converters.
    pace
        Pace of rig time; by default, time passes on demand.
    address
        ``"host:port"``; port 0 selects a free port, see `DaqServer.address`.
    catalogue
        The devices; by default a cDAQ with an NI 9234, a USB-4431 and a USB-6211.
    handlers
        Further gRPC services on the same port.
    token
        Token required for every call; with None, anyone who can reach the port is accepted.

    Raises ConfigurationError when the address cannot be used.
    """

    def __init__(
        self,
        world: World,
        pace: Pace | None = None,
        address: str = LOOPBACK,
        *,
        catalogue: Catalogue | None = None,
        handlers: Iterable[grpc.GenericRpcHandler] = (),
        token: str | None = None,
    ) -> None:
        _require_address(address)
        self.faults = Faults()
        self._refused: set[str] = set()
        """Names of calls that failed at their last attempt."""
        self._pace = pace or OnDemandPace()
        self._rig = Rig(world, self._pace, catalogue or Catalogue())
        self._system = DaqmxSystem(self._rig)
        self._workers = ThreadPoolExecutor(_WORKERS, thread_name_prefix="daqmx")
        guards = () if token is None else (TokenCheck(token),)
        self._server = grpc.server(self._workers, options=_OPTIONS, interceptors=guards)
        listening = {name: self._listen(name, partial(call, self._system)) for name, call in EVENTS.items()}
        self._server.add_generic_rpc_handlers((_Service(self._unary_calls(), listening), *handlers))
        try:
            port = self._server.add_insecure_port(address)
        except RuntimeError as error:
            raise ConfigurationError(
                f"The simulated DAQ cannot listen on {address}: the address is in use or does not exist; "
                f"nothing was started. Use another port, or port 0 for a free port"
            ) from error
        self.address = f"{address.rpartition(':')[0]}:{port}"
        with self._rig.changed:
            self._pace.open(self._rig)
        self._server.start()

    def __enter__(self) -> Self:
        """Return the server, which has been running since its creation."""
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def let_pass(self, duration_s: float) -> None:
        """Advance rig time without a client's request."""
        with self._rig.changed:
            self._rig.advance_to(self._rig.now_s + duration_s)

    def edge(self, terminal: str) -> None:
        """Apply a rising edge to a terminal, such as ``"/Dev1/PFI0"``, and start the waiting tasks."""
        with self._rig.changed:
            self._rig.edge(terminal)

    def close(self) -> None:
        """Stop the server; may be called repeatedly."""
        with self._rig.changed:
            self._system.reset()
        self._server.stop(grace=None).wait()
        with self._rig.changed:  # a call that ended late may have started a task
            self._system.reset()
        self._pace.close()
        self._workers.shutdown(wait=True)

    # --- requests and responses -----------------------------------------------------------

    def _unary_calls(self) -> dict[str, Handler]:
        calls = attribute_calls(self._system)
        calls |= {name: partial(call, self._system) for name, call in CALLS.items()}
        calls |= {name: partial(self._on_task, call) for name, call in {**TASK_CALLS, **DATA_CALLS}.items()}
        return {name: self._answer(name, call) for name, call in calls.items()}

    def _on_task(self, call: TaskCall, request: Any) -> Fields:
        return call(self._system.task(request.task.name), request) or {}

    def _answer(self, name: str, call: Callable[[Any], Fields]) -> Handler:
        def handle(request: Any, context: grpc.ServicerContext) -> Fields:
            with _report_refusals(context), self._rig.changed:
                self._check_faults(name)
                if self.faults.take_restart():
                    self._system.reset()
                return call(request)

        return handle

    def _check_faults(self, name: str) -> None:
        """Raise an error if a rule applies. The first failure takes no rig time, each repeated failure does.

        Successful calls take no time, because readers would otherwise fall behind.
        """
        try:
            self.faults.check(name)
        except DaqmxRefusal:  # a first refusal takes no rig time
            if name in self._refused:
                self._pace.pass_time(self._rig, FAILED_CALL_S)
            self._refused.add(name)
            raise
        self._refused.discard(name)

    def _listen(self, name: str, call: Callable[[Any, grpc.ServicerContext], Listener]) -> Handler:
        def handle(request: Any, context: grpc.ServicerContext) -> Iterator[Any]:
            with _report_refusals(context), self._rig.changed:
                self.faults.check(name)
                listener = call(request, context)
            context.send_initial_metadata(())  # the client waits for metadata
            yield from listener

        return handle


@contextmanager
def _report_refusals(context: grpc.ServicerContext) -> Iterator[None]:
    """Convert a refusal to gRPC status UNKNOWN, with the DAQmx code in the trailing metadata."""
    try:
        try:
            yield
        except ConfigurationError as error:  # the simulation does not support this capability
            raise DaqmxRefusal(DAQmxErrors.INVALID_ATTRIBUTE_VALUE, str(error)) from error
    except DaqmxRefusal as refusal:
        entries = (
            ("ni-error", refusal.code),
            ("ni-samps-per-chan-read", refusal.samples_read),
            ("ni-samps-per-chan-written", refusal.samples_written),
        )
        context.set_trailing_metadata(
            tuple((key, str(number)) for key, number in entries if number is not None)
        )
        context.abort(grpc.StatusCode.UNKNOWN, str(refusal))
    except Unavailable as error:
        context.abort(grpc.StatusCode.UNAVAILABLE, str(error))


def _require_address(address: str) -> None:
    """Refuse text other than ``host:port``; gRPC would map too large port numbers to other ports."""
    host, _, port = address.rpartition(":")
    if not host or not port.isdecimal() or int(port) > LAST_PORT:
        raise ConfigurationError(
            f"{address!r} is not an address to listen on; nothing was started. Give HOST:PORT with a port up "
            f"to {LAST_PORT}, such as 127.0.0.1:31763; port 0 selects a free port"
        )


class _Service(grpc.GenericRpcHandler):  # type: ignore[misc]
    """The methods of the service; each is prepared at its first call, as programs use about 30 of 451."""

    def __init__(self, unary: dict[str, Handler], listening: dict[str, Handler]) -> None:
        self._unary = unary
        self._listening = listening

    def service(self, handler_call_details: grpc.HandlerCallDetails) -> grpc.RpcMethodHandler | None:
        """Return the handler of a call; None if the call belongs to another service."""
        service, _, name = handler_call_details.method.removeprefix("/").partition("/")
        method = SERVICE.methods_by_name.get(name)
        if service != SERVICE.full_name or method is None:
            return None
        request, response = (
            getattr(nidaqmx_pb2, each.name) for each in (method.input_type, method.output_type)
        )
        if name in self._listening:
            return grpc.unary_stream_rpc_method_handler(
                self._listening[name], request.FromString, lambda message: message.SerializeToString()
            )

        def serialise(answer: Fields) -> bytes:
            return bytes(response(**answer).SerializeToString())

        handler = self._unary.get(name) or partial(_refuse_call, name)
        return grpc.unary_unary_rpc_method_handler(handler, request.FromString, serialise)


def _refuse_call(name: str, request: Any, context: grpc.ServicerContext) -> None:  # noqa: ARG001 - not read
    context.abort(grpc.StatusCode.UNIMPLEMENTED, f"{name} is not part of the simulated DAQmx driver.")
