"""Events of the simulated driver: streams of responses that a client's callbacks listen to."""

from collections.abc import Callable, Iterator
from typing import Any

import grpc
from nidaqmx._stubs import nidaqmx_pb2
from nidaqmx.constants import EveryNSamplesEventType, Signal
from nidaqmx.error_codes import DAQmxErrors

from ._acquisition import Acquisition
from ._calls import pick
from ._errors import DaqmxRefusal, member, unsupported_value
from ._generation import Generation
from ._pace import Overflow
from ._system import DaqmxSystem
from ._tasks import Task

Listener = Iterator[Any]
Stream = Acquisition | Generation
_EVERY_SAMPLE = 1
_FOR_EVER = -1.0
_BY_OTHERS = float("inf")
"""Rig time of something that other calls must bring about."""


class EventCalls:
    """The three calls whose responses go on until the client or the task ends them.

    A listener waits for rig time like a reader does: on demand, it is the listener who lets time pass,
    and for every-N-samples events it goes on when the samples announced have been read.
    """

    def __init__(self, system: DaqmxSystem) -> None:
        """Listen to the tasks of that system."""
        self._system = system

    def calls(self) -> dict[str, Callable[[Any, grpc.ServicerContext], Listener]]:
        """Give the calls by their name in the protocol."""
        return {
            "RegisterEveryNSamplesEvent": self._every_n_samples,
            "RegisterDoneEvent": self._done,
            "RegisterSignalEvent": self._signal,
        }

    def _every_n_samples(self, request: Any, context: grpc.ServicerContext) -> Listener:
        kind = member(
            EveryNSamplesEventType, pick(request, "every_n_samples_event_type"), "every N samples event"
        )
        task = self._system.task(request.task.name)
        if request.n_samples < 1:
            raise DaqmxRefusal(DAQmxErrors.EVERY_N_SAMPS_EVENT_INTERVAL_ZERO_NOT_SUPPORTED)
        is_input = kind is EveryNSamplesEventType.ACQUIRED_INTO_BUFFER
        if is_input and task.outputs:
            raise DaqmxRefusal(DAQmxErrors.EVERY_N_SAMPS_ACQ_INTO_BUFFER_NOT_FOR_OUTPUT)
        if not is_input and task.inputs:
            raise DaqmxRefusal(DAQmxErrors.EVERY_N_SAMPS_TRANSFERRED_FROM_BUFFER_NOT_FOR_INPUT)
        response = nidaqmx_pb2.RegisterEveryNSamplesEventResponse(
            every_n_samples_event_type_raw=kind.value, n_samples=request.n_samples
        )
        return self._repeat(task, request.n_samples, response, context)

    def _signal(self, request: Any, context: grpc.ServicerContext) -> Listener:
        signal = pick(request, "signal_id")
        task = self._system.task(request.task.name)
        if signal not in (Signal.SAMPLE_CLOCK.value, Signal.SAMPLE_COMPLETE.value):
            raise unsupported_value("signal", signal, "SAMPLE_CLOCK, SAMPLE_COMPLETE")
        response = nidaqmx_pb2.RegisterSignalEventResponse(signal_id=signal)
        return self._repeat(task, _EVERY_SAMPLE, response, context)

    def _done(self, request: Any, context: grpc.ServicerContext) -> Listener:
        return self._await_end(self._system.task(request.task.name), context)

    # --- the streams; each runs on a thread of its own and takes the rig's lock only while it looks

    def _repeat(self, task: Task, interval: int, response: Any, context: grpc.ServicerContext) -> Listener:
        subscription = _Subscription(self._system, task, context)
        while stream := subscription.await_run():
            count = interval
            while subscription.await_count(stream, count, count - interval):
                yield response
                count += interval

    def _await_end(self, task: Task, context: grpc.ServicerContext) -> Listener:
        subscription = _Subscription(self._system, task, context)
        while stream := subscription.await_run():
            if subscription.await_end(stream):
                status = stream.failure.code if stream.failure else 0
                yield nidaqmx_pb2.RegisterDoneEventResponse(status=status)


class _Subscription:
    """One listener's view of one task: which run it has followed, and whether its client is still there."""

    def __init__(self, system: DaqmxSystem, task: Task, context: grpc.ServicerContext) -> None:
        self._system = system
        self._rig = system.rig
        self._task = task
        self._context = context
        self._followed: Stream | None = None
        context.add_callback(self._wake)

    def _wake(self) -> None:
        with self._rig.changed:
            self._rig.changed.notify_all()

    @property
    def _has_gone(self) -> bool:
        return not self._context.is_active() or self._system.tasks.get(self._task.name) is not self._task

    def _wait(self, until_s: float, is_there: Callable[[], bool]) -> None:
        self._rig.pace.ask(self._rig, until_s, lambda: is_there() or self._has_gone, _FOR_EVER)

    def await_run(self) -> Stream | None:
        """Wait for a run not followed yet; None when there is nobody to tell any more."""
        with self._rig.changed:
            self._wait(_BY_OTHERS, lambda: self._task.stream not in (None, self._followed))
            self._followed = None if self._has_gone else self._task.stream
            return self._followed

    def await_count(self, stream: Stream, count: int, announced: int) -> bool:
        """Wait until ``count`` samples have passed; False when this run will not get there.

        Where nothing is lost nobody is hurried either: the next samples come when those announced are read.
        """
        with self._rig.changed:
            if self._rig.pace.overflow is Overflow.GROW:
                self._wait(_BY_OTHERS, lambda: stream.used >= announced or self._is_over(stream))
            self._wait(
                stream.listened_until_s(count), lambda: stream.passed >= count or self._is_over(stream)
            )
            return stream.passed >= count and not self._has_gone

    def await_end(self, stream: Stream) -> bool:
        """Wait for the end of a run; False if it was stopped instead."""
        with self._rig.changed:
            self._wait(stream.time_of(stream.total), lambda: self._is_over(stream))
            return stream.is_done and not self._has_gone

    def _is_over(self, stream: Stream) -> bool:
        return stream.is_done or self._task.stream is not stream
