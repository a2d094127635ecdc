"""The calls on tasks, channels, clocks, triggers and devices, in one table.

Their names are those of NI's protocol file (`nidaqmx.proto`); the function of that name with ``DAQmx`` before
it stands in the NI-DAQmx C reference.
"""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from nidaqmx.constants import (
    AcquisitionType,
    Edge,
    LoggingMode,
    LoggingOperation,
    SampleTimingType,
    TaskMode,
    TerminalConfiguration,
    VoltageUnits,
)
from nidaqmx.error_codes import DAQmxErrors
from session_pb2 import Session, SessionInitializationBehavior

from .channels import InputChannel, OutputChannel, assigned_names
from .errors import DaqmxRefusal, member, sentence, unsupported_value
from .system import DaqmxSystem
from .tasks import Task
from .timing import LogSettings, ReferenceTrigger

Fields = Mapping[str, object]
"""The fields of a response; status 0 is left out."""
Call = Callable[[DaqmxSystem, Any], Fields | bytes]
"""Takes the system and the request, returns the response as fields or ready for the wire."""

NOTHING: Fields = {}


def pick(request: Any, field: str) -> int:
    """Return an enum of a request: the bare number if given, else the named value."""
    return int(getattr(request, f"{field}_raw") or getattr(request, field))


def task_of(system: DaqmxSystem, request: Any) -> Task:
    """Return the task that a request names."""
    return system.task(request.task.name)


def _stopped_task(system: DaqmxSystem, request: Any) -> Task:
    task = task_of(system, request)
    task.require_stopped()
    return task


def _create(system: DaqmxSystem, request: Any) -> Fields:
    name, behavior = request.session_name, request.initialization_behavior
    exists = name in system.tasks
    if behavior == SessionInitializationBehavior.SESSION_INITIALIZATION_BEHAVIOR_ATTACH_TO_EXISTING:
        system.task(name)
    is_new = behavior == SessionInitializationBehavior.SESSION_INITIALIZATION_BEHAVIOR_INITIALIZE_NEW
    if exists and not is_new:
        return {"task": Session(name=name), "new_session_initialized": False}
    task = system.create_task(name)
    return {"task": Session(name=task.name), "new_session_initialized": True}


def _is_done(system: DaqmxSystem, request: Any) -> Fields:
    task = task_of(system, request)
    if not task.is_done():
        task.rig.pace.answer_progress(task.rig)
    return {"is_task_done": task.is_done()}


def _require_volts(request: Any) -> None:
    if pick(request, "units") not in (0, VoltageUnits.VOLTS.value):
        raise unsupported_value("units", pick(request, "units"), "VOLTS")


def _add_inputs(system: DaqmxSystem, request: Any) -> Fields:
    task = task_of(system, request)
    _require_volts(request)
    terminal = member(TerminalConfiguration, pick(request, "terminal_config"), "AI_TermCfg")
    places = system.inputs(request.physical_channel)
    for place, name in zip(places, assigned_names(request.name_to_assign_to_channel, places), strict=True):
        device = system.device(place)
        assert device.inputs is not None
        limits = request.min_val, request.max_val
        task.add(InputChannel(name, place, device, device.inputs, *limits, terminal))
    return NOTHING


def _add_outputs(system: DaqmxSystem, request: Any) -> Fields:
    task = task_of(system, request)
    _require_volts(request)
    places = system.outputs(request.physical_channel)
    for place, name in zip(places, assigned_names(request.name_to_assign_to_channel, places), strict=True):
        device = system.device(place)
        assert device.outputs is not None
        task.add(OutputChannel(name, place, device, device.outputs, request.min_val, request.max_val))
    return NOTHING


def _set_clock(system: DaqmxSystem, request: Any) -> Fields:
    task = task_of(system, request)
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
    return NOTHING


def _set_start_trigger(system: DaqmxSystem, request: Any) -> Fields:
    member(Edge, pick(request, "trigger_edge"), "DigEdge_StartTrig_Edge")
    task = _stopped_task(system, request)
    task.timing.trigger_source = task.full_terminal(request.trigger_source)
    return NOTHING


def _set_reference_trigger(system: DaqmxSystem, request: Any) -> Fields:
    member(Edge, pick(request, "trigger_edge"), "DigEdge_RefTrig_Edge")
    task = _stopped_task(system, request)
    terminal = task.full_terminal(request.trigger_source)
    task.timing.reference = ReferenceTrigger(terminal, request.pretrigger_samples)
    return NOTHING


def _set_logging(system: DaqmxSystem, request: Any) -> Fields:
    task = _stopped_task(system, request)
    if task.outputs:
        raise DaqmxRefusal(DAQmxErrors.LOGGING_NOT_SUPPORT_ON_OUTPUT_TASKS, f"Task Name: {task.name}")
    mode = member(LoggingMode, pick(request, "logging_mode"), "Logging_Mode")
    operation = member(LoggingOperation, pick(request, "operation"), "Logging_TDMS_Operation")
    if mode is LoggingMode.LOG:
        raise unsupported_value("Logging_Mode", mode.name, "OFF, LOG_AND_READ")
    if mode is LoggingMode.LOG_AND_READ and operation is not LoggingOperation.CREATE_OR_REPLACE:
        raise unsupported_value("Logging_TDMS_Operation", operation.name, "CREATE_OR_REPLACE")
    settings = LogSettings(Path(request.file_path), request.group_name or task.name)
    task.reading.logging = None if mode is LoggingMode.OFF else settings
    return NOTHING


def _does(act: Callable[[DaqmxSystem, Any], object]) -> Call:
    """Return a call without an answer."""

    def call(system: DaqmxSystem, request: Any) -> Fields:
        act(system, request)
        return NOTHING

    return call


def _control(system: DaqmxSystem, request: Any) -> None:
    task_of(system, request).control(member(TaskMode, pick(request, "action"), "task action"))


# fmt: off
CALLS: Mapping[str, Call] = {
    "CreateTask": _create,
    "ClearTask": _does(lambda system, request: system.clear_task(request.task.name)),
    "StartTask": _does(lambda system, request: task_of(system, request).start()),
    "StopTask": _does(lambda system, request: task_of(system, request).stop()),
    "TaskControl": _does(_control),
    "IsTaskDone": _is_done,
    "WaitUntilTaskDone": _does(
        lambda system, request: task_of(system, request).wait_until_done(request.time_to_wait)),
    "CreateAIVoltageChan": _add_inputs,
    "CreateAOVoltageChan": _add_outputs,
    "CfgSampClkTiming": _set_clock,
    "CfgDigEdgeStartTrig": _set_start_trigger,
    "CfgDigEdgeRefTrig": _set_reference_trigger,
    "ConfigureLogging": _set_logging,
    # The client has already ended the stream it listened to; there is nothing else to undo.
    "UnregisterEveryNSamplesEvent": _does(task_of),
    "GetErrorString": lambda _, request: {"error_string": sentence(request.error_code)},
    "ResetDevice": _does(lambda system, request: system.reset_device(request.device_name)),
}
"""The calls by their names in the protocol; those that move samples stand in `_data_calls`."""
# fmt: on
