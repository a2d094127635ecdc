"""The event of the simulated driver: a stream of responses that a client's callback listens to."""

from collections.abc import Callable, Iterator
from typing import Any

import grpc
from nidaqmx._stubs import nidaqmx_pb2
from nidaqmx.constants import EveryNSamplesEventType
from nidaqmx.error_codes import DAQmxErrors

from .acquisition import Acquisition
from .calls import pick, task_of
from .errors import DaqmxRefusal, member
from .generation import Generation
from .system import DaqmxSystem
from .tasks import Task
from .timing import Overflow

Listener = Iterator[Any]
Stream = Acquisition | Generation
_FOR_EVER = -1.0
_BY_OTHERS = float("inf")
"""Rig time of something that other calls must bring about."""


def every_n_samples(system: DaqmxSystem, request: Any, context: grpc.ServicerContext) -> Listener:
    """Answer again and again, every ``n_samples`` of a task, until the client or the task ends it.

    A listener waits for rig time like a reader does: on demand, it is the listener who lets time pass,
    and it goes on when the samples announced have been read.
    """
    kind = member(
        EveryNSamplesEventType, pick(request, "every_n_samples_event_type"), "every N samples event"
    )
    task = task_of(system, request)
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
    return _repeat(system, task, response, context)


def _repeat(system: DaqmxSystem, task: Task, response: Any, context: grpc.ServicerContext) -> Listener:
    """Run on a thread of its own, and take the rig's lock only while looking."""
    subscription = _Subscription(system, task, context)
    while stream := subscription.await_run():
        count = response.n_samples
        while subscription.await_count(stream, count, count - response.n_samples):
            yield response
            count += response.n_samples


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

    def _is_over(self, stream: Stream) -> bool:
        return stream.is_done or self._task.stream is not stream


EVENTS = {"RegisterEveryNSamplesEvent": every_n_samples}
"""The calls that answer with a stream, by their names in the protocol."""
