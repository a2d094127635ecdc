"""Table of the calls on tasks, channels, clocks and triggers.

Names are as in NI's protocol file (`nidaqmx.proto`); with the prefix ``DAQmx``, the NI-DAQmx C reference
describes them.
"""

import math
import time
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import grpc
from nidaqmx._stubs import nidaqmx_pb2
from nidaqmx.constants import (
    AcquisitionType,
    Edge,
    EveryNSamplesEventType,
    LoggingMode,
    LoggingOperation,
    SampleTimingType,
    TaskMode,
    TerminalConfiguration,
    VoltageUnits,
)
from nidaqmx.error_codes import DAQmxErrors
from session_pb2 import Session

from .devices import Device, InputChannel, OutputChannel, channel_names
from .errors import DaqmxRefusal, member, sentence, unsupported_value
from .rig import QUESTION_S, Rig
from .streams import Acquisition, Stream
from .tasks import Task, TdmsLog

Fields = Mapping[str, object]
"""The fields of a response; a status of 0 is omitted."""


class DaqmxSystem:
    """State of the simulated driver; the caller must hold the rig's lock."""

    def __init__(self, rig: Rig) -> None:
        self.rig = rig
        self.tasks: dict[str, Task] = {}
        self._unnamed = 0

    def task(self, name: str) -> Task:
        """Return the task of this name (-200088 if there is no such task)."""
        if name not in self.tasks:
            raise DaqmxRefusal(DAQmxErrors.INVALID_TASK, f"Task Name: {name}")
        return self.tasks[name]

    def create(self, request: Any) -> Fields:
        """Create a task; if the name is empty, choose a name. Programs cannot share a task (-200089)."""
        name = request.session_name
        if name in self.tasks:
            raise DaqmxRefusal(DAQmxErrors.DUPLICATE_TASK, f"Task Name: {name}")
        if not name:
            name = f"_unnamedTask<{self._unnamed}>"
            self._unnamed += 1
        self.tasks[name] = Task(name, self.rig)
        return {"task": Session(name=name), "new_session_initialized": True}

    def clear(self, request: Any) -> Fields:
        """End a task and delete it."""
        self.task(request.task.name).abort()
        del self.tasks[request.task.name]
        self.rig.changed.notify_all()
        return {}

    def reset(self) -> None:
        """Delete every task, including the tasks of disconnected clients."""
        for task in self.tasks.values():
            task.abort()
        self.tasks.clear()
        self.rig.changed.notify_all()


TaskCall = Callable[[Task, Any], Fields | None]
"""Function of a task and a request, which returns the fields of the response, if any."""


def pick(request: Any, field: str) -> int:
    """Return the number of an enum in a request: its raw number if given, else the number of its name."""
    return int(getattr(request, f"{field}_raw") or getattr(request, field))


def deadline(timeout_s: float) -> float:
    """Return the time of the monotonic clock at which a timeout ends; infinite for a negative timeout [s]."""
    return math.inf if timeout_s < 0 else time.monotonic() + timeout_s


def _is_done(task: Task, _: Any) -> Fields:
    if not task.is_done():
        task.rig.pace.pass_time(task.rig, QUESTION_S)
    return {"is_task_done": task.is_done()}


def _add_inputs(task: Task, request: Any) -> None:
    terminal = member(TerminalConfiguration, pick(request, "terminal_config"), "AI_TermCfg")
    for channel in _new_channels(task, request, lambda device: device.input_names):
        task.add(InputChannel(*channel, request.min_val, request.max_val, terminal))


def _add_outputs(task: Task, request: Any) -> None:
    for channel in _new_channels(task, request, lambda device: device.output_names):
        task.add(OutputChannel(*channel, request.min_val, request.max_val))


def _new_channels(
    task: Task, request: Any, side: Callable[[Device], tuple[str, ...]]
) -> list[tuple[str, str, Device]]:
    """Return name, physical name and device of each voltage channel that a request creates."""
    if pick(request, "units") not in (0, VoltageUnits.VOLTS.value):
        raise unsupported_value("units", pick(request, "units"), "VOLTS")
    found = task.rig.catalogue.physical(request.physical_channel, side)
    names = channel_names(request.name_to_assign_to_channel, tuple(place for place, _ in found))
    return [(name, place, device) for name, (place, device) in zip(names, found, strict=True)]


def _set_clock(task: Task, request: Any) -> None:
    task.require_channels()
    task.require_stopped()
    mode = pick(request, "sample_mode")
    if mode not in (AcquisitionType.FINITE.value, AcquisitionType.CONTINUOUS.value):
        raise unsupported_value("SampQuant_SampMode", mode, "FINITE, CONTINUOUS")
    member(Edge, pick(request, "active_edge"), "SampClk_ActiveEdge")
    if request.samps_per_chan < 1:
        raise unsupported_value("SampQuant_SampPerChan", request.samps_per_chan, "1 or more")
    task.timing.kind = SampleTimingType.SAMPLE_CLOCK
    task.timing.requested_hz = request.rate
    task.timing.mode = AcquisitionType(mode)
    task.timing.samples = request.samps_per_chan
    task.timing.clock_source = request.source


def _set_start_trigger(task: Task, request: Any) -> None:
    member(Edge, pick(request, "trigger_edge"), "DigEdge_StartTrig_Edge")
    task.require_stopped()
    task.timing.trigger_source = task.full_terminal(request.trigger_source)


def _set_logging(task: Task, request: Any) -> None:
    task.require_stopped()
    if task.outputs:
        raise task.refusal(DAQmxErrors.LOGGING_NOT_SUPPORT_ON_OUTPUT_TASKS)
    mode = member(LoggingMode, pick(request, "logging_mode"), "Logging_Mode")
    operation = member(LoggingOperation, pick(request, "operation"), "Logging_TDMS_Operation")
    if mode is LoggingMode.LOG:
        raise unsupported_value("Logging_Mode", mode.name, "OFF, LOG_AND_READ")
    if mode is LoggingMode.LOG_AND_READ and operation is not LoggingOperation.CREATE_OR_REPLACE:
        raise unsupported_value("Logging_TDMS_Operation", operation.name, "CREATE_OR_REPLACE")
    group = request.group_name or task.name
    task.log = None if mode is LoggingMode.OFF else TdmsLog(Path(request.file_path), group)


CALLS: Mapping[str, Callable[[DaqmxSystem, Any], Fields]] = {
    "CreateTask": DaqmxSystem.create,
    "ClearTask": DaqmxSystem.clear,
    "GetErrorString": lambda _, request: {"error_string": sentence(request.error_code)},
}
"""Calls on the driver, keyed by their names in the protocol."""

# fmt: off
TASK_CALLS: Mapping[str, TaskCall] = {
    "StartTask": lambda task, _: task.start(),
    "StopTask": lambda task, _: task.stop(),
    "TaskControl": lambda task, request: task.control(
        member(TaskMode, pick(request, "action"), "task action")),
    "IsTaskDone": _is_done,
    "WaitUntilTaskDone": lambda task, request: task.wait_until_done(deadline(request.time_to_wait)),
    "CreateAIVoltageChan": _add_inputs,
    "CreateAOVoltageChan": _add_outputs,
    "CfgSampClkTiming": _set_clock,
    "CfgDigEdgeStartTrig": _set_start_trigger,
    "ConfigureLogging": _set_logging,
    # Do nothing: the client has already closed the event stream.
    "UnregisterEveryNSamplesEvent": lambda *_: None,
}
"""Calls on a task, keyed by their names in the protocol; calls that transfer samples are in `DATA_CALLS`."""
# fmt: on


Listener = Iterator[Any]
_BY_OTHERS = math.inf
"""Rig time [s] that stands for an event that only other calls can cause."""


def every_n_samples(system: DaqmxSystem, request: Any, context: grpc.ServicerContext) -> Listener:
    """Yield a response every ``n_samples`` of a task, until the client or the task ends the stream.

    Like a reader, a listener waits for rig time. With time on demand, the listener advances time, and
    continues when the announced samples have been read.
    """
    kind = member(
        EveryNSamplesEventType, pick(request, "every_n_samples_event_type"), "every N samples event"
    )
    task = system.task(request.task.name)
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
    """Yield the responses from a separate thread, which holds the rig's lock only during its checks."""
    subscription = _Subscription(system, task, context)
    while stream := subscription.await_run():
        count = response.n_samples
        while subscription.await_count(stream, count, count - response.n_samples):
            yield response
            count += response.n_samples


class _Subscription:
    """A listener on one task: its current run, and whether its client is connected."""

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
        self._rig.pace.ask(self._rig, until_s, lambda: is_there() or self._has_gone, math.inf)

    def await_run(self) -> Stream | None:
        """Wait for the next run of the task; return None if the client or the task is gone."""
        with self._rig.changed:
            self._wait(_BY_OTHERS, lambda: self._task.stream not in (None, self._followed))
            self._followed = None if self._has_gone else self._task.stream
            return self._followed

    def await_count(self, stream: Stream, count: int, announced: int) -> bool:
        """Wait until ``count`` samples are transferred; return False if the run ends first.

        If the buffer never loses samples, first wait until the announced samples have been read.
        """
        with self._rig.changed:
            due_s = _BY_OTHERS  # do not advance rig time for a repeated buffer
            if isinstance(stream, Acquisition):
                due_s = stream.time_of(count)
                if not self._rig.pace.loses_samples:
                    self._wait(_BY_OTHERS, lambda: stream.position >= announced or self._is_over(stream))
            self._wait(due_s, lambda: stream.reaches(count) or self._is_over(stream))
            return stream.reaches(count) and not self._has_gone

    def _is_over(self, stream: Stream) -> bool:
        return stream.is_done or self._task.stream is not stream


EVENTS = {"RegisterEveryNSamplesEvent": every_n_samples}
"""Calls with a stream of responses, keyed by their names in the protocol."""
