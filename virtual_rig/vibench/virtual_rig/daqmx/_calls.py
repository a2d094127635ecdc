"""What a remote call of the simulated driver is, and the calls on tasks, clocks, scales and devices."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from nidaqmx.constants import (
    AcquisitionType,
    Edge,
    LoggingMode,
    LoggingOperation,
    SampleTimingType,
    ScaleType,
    Slope,
    TaskMode,
)
from nidaqmx.error_codes import DAQmxErrors
from session_pb2 import Session, SessionInitializationBehavior

from ._errors import DaqmxRefusal, member, sentence, unsupported_value
from ._scales import LinearScale, PolynomialScale, TableScale
from ._system import DaqmxSystem
from ._task_attributes import full_terminal, set_output_buffer, set_trigger_source
from ._tasks import Task
from ._timing import LogSettings, ReferenceTrigger, check_samples

Fields = Mapping[str, object]
"""The fields of a response; status 0 is left out."""

Call = Callable[[Any], Fields | bytes]
"""Takes the request, returns the response as fields or ready for the wire."""

NOTHING: Fields = {}


def pick(request: Any, field: str) -> int:
    """Take an enum of a request: the bare number if given, else the named value."""
    return int(getattr(request, f"{field}_raw") or getattr(request, field))


class TaskCalls:
    """Calls that make, change, run and end tasks."""

    def __init__(self, system: DaqmxSystem) -> None:
        """Work on that system."""
        self._system = system

    def calls(self) -> dict[str, Call]:
        """Give the calls by their name in the protocol."""
        return {
            "CreateTask": self._create,
            "ClearTask": self._clear,
            "StartTask": self._start,
            "StopTask": self._stop,
            "TaskControl": self._control,
            "IsTaskDone": self._is_done,
            "WaitUntilTaskDone": self._wait,
            "GetNthTaskChannel": self._nth_channel,
            "GetNthTaskReadChannel": self._nth_channel,
            "GetNthTaskDevice": self._nth_device,
            "CfgSampClkTiming": self._clock,
            "CfgInputBuffer": self._input_buffer,
            "CfgOutputBuffer": self._output_buffer,
            "CfgDigEdgeStartTrig": self._edge_trigger,
            "ConfigureLogging": self._logging,
            "CfgDigEdgeRefTrig": self._digital_reference,
            "CfgAnlgEdgeRefTrig": self._analog_reference,
            "UnregisterEveryNSamplesEvent": self._unregister,
            "UnregisterDoneEvent": self._unregister,
            "UnregisterSignalEvent": self._unregister,
            "DisableStartTrig": self._no_trigger,
            "DisableRefTrig": self._no_reference_trigger,
        }

    def _task(self, request: Any) -> Task:
        return self._system.task(request.task.name)

    def _create(self, request: Any) -> Fields:
        name, behavior = request.session_name, request.initialization_behavior
        exists = name in self._system.tasks
        if behavior == SessionInitializationBehavior.SESSION_INITIALIZATION_BEHAVIOR_ATTACH_TO_EXISTING:
            self._system.task(name)
        is_new = behavior == SessionInitializationBehavior.SESSION_INITIALIZATION_BEHAVIOR_INITIALIZE_NEW
        if exists and not is_new:
            return {"task": Session(name=name), "new_session_initialized": False}
        task = self._system.create_task(name)
        return {"task": Session(name=task.name), "new_session_initialized": True}

    def _clear(self, request: Any) -> Fields:
        self._system.clear_task(request.task.name)
        return NOTHING

    def _start(self, request: Any) -> Fields:
        self._task(request).start()
        return NOTHING

    def _stop(self, request: Any) -> Fields:
        self._task(request).stop()
        return NOTHING

    def _control(self, request: Any) -> Fields:
        self._task(request).control(member(TaskMode, pick(request, "action"), "task action"))
        return NOTHING

    def _is_done(self, request: Any) -> Fields:
        task = self._task(request)
        if not task.is_done():
            task.rig.pace.answer_progress(task.rig)
        return {"is_task_done": task.is_done()}

    def _wait(self, request: Any) -> Fields:
        self._task(request).wait_until_done(request.time_to_wait)
        return NOTHING

    def _nth_channel(self, request: Any) -> Fields:
        return {"buffer": _nth([channel.name for channel in self._task(request).channels], request.index)}

    def _nth_device(self, request: Any) -> Fields:
        return {"buffer": _nth([device.name for device in self._task(request).devices], request.index)}

    def _clock(self, request: Any) -> Fields:
        task = self._task(request)
        task.require_channels()
        task.require_stopped()
        mode = pick(request, "sample_mode")
        if mode not in (AcquisitionType.FINITE.value, AcquisitionType.CONTINUOUS.value):
            raise unsupported_value("SampQuant_SampMode", mode, "FINITE, CONTINUOUS")
        task.timing.kind = SampleTimingType.SAMPLE_CLOCK
        task.timing.requested_hz = request.rate
        task.timing.mode = AcquisitionType(mode)
        task.timing.samples = check_samples(request.samps_per_chan)
        task.timing.clock_source = request.source
        task.timing.clock_edge = member(Edge, pick(request, "active_edge"), "SampClk_ActiveEdge")
        return NOTHING

    def _input_buffer(self, request: Any) -> Fields:
        task = self._task(request)
        task.require_stopped()
        task.reading.buffer_size = request.num_samps_per_chan
        return NOTHING

    def _output_buffer(self, request: Any) -> Fields:
        set_output_buffer(self._task(request), request.num_samps_per_chan)
        return NOTHING

    def _edge_trigger(self, request: Any) -> Fields:
        task = self._task(request)
        task.require_stopped()
        set_trigger_source(task, request.trigger_source)
        task.timing.trigger_edge = member(Edge, pick(request, "trigger_edge"), "DigEdge_StartTrig_Edge")
        return NOTHING

    def _no_trigger(self, request: Any) -> Fields:
        task = self._task(request)
        task.require_stopped()
        task.timing.trigger_source = ""
        return NOTHING

    def _unregister(self, request: Any) -> Fields:
        # The client has already ended the stream it listened to; there is nothing else to undo.
        self._task(request)
        return NOTHING

    def _logging(self, request: Any) -> Fields:
        task = self._task(request)
        task.require_stopped()
        if task.outputs:
            raise DaqmxRefusal(DAQmxErrors.LOGGING_NOT_SUPPORT_ON_OUTPUT_TASKS, f"Task Name: {task.name}")
        mode = member(LoggingMode, pick(request, "logging_mode"), "Logging_Mode")
        operation = member(LoggingOperation, pick(request, "operation"), "Logging_TDMS_Operation")
        settings = LogSettings(Path(request.file_path), mode, request.group_name or task.name, operation)
        task.reading.logging = None if mode is LoggingMode.OFF else settings
        return NOTHING

    def _digital_reference(self, request: Any) -> Fields:
        task = self._task(request)
        slope = member(Slope, pick(request, "trigger_edge"), "DigEdge_RefTrig_Edge")
        source = full_terminal(task, request.trigger_source)
        return _refer(task, ReferenceTrigger(source, request.pretrigger_samples, slope=slope))

    def _analog_reference(self, request: Any) -> Fields:
        task = self._task(request)
        slope = member(Slope, pick(request, "trigger_slope"), "AnlgEdge_RefTrig_Slope")
        (channel,) = task.find(request.trigger_source)
        level = request.trigger_level
        return _refer(task, ReferenceTrigger(channel.name, request.pretrigger_samples, level, slope))

    def _no_reference_trigger(self, request: Any) -> Fields:
        return _refer(self._task(request), None)


def _refer(task: Task, reference: ReferenceTrigger | None) -> Fields:
    task.require_stopped()
    task.timing.reference = reference
    return NOTHING


def _nth(names: list[str], index: int) -> str:
    if not 1 <= index <= len(names):
        raise DaqmxRefusal(
            DAQmxErrors.INVALID_ATTRIBUTE_VALUE, f"Index {index}; there are {len(names)}, from 1 on."
        )
    return names[index - 1]


class SystemCalls:
    """Calls on devices, scales and error texts."""

    def __init__(self, system: DaqmxSystem) -> None:
        """Work on that system."""
        self._system = system

    def calls(self) -> dict[str, Call]:
        """Give the calls by their name in the protocol."""
        return {
            "GetErrorString": lambda request: {"error_string": sentence(request.error_code)},
            "ResetDevice": self._reset,
            "SelfTestDevice": self._known_device,
            "SelfCal": self._known_device,
            "DeviceSupportsCal": self._supports_calibration,
            "GetExtCalLastDateAndTime": self._calibrated,
            "GetSelfCalLastDateAndTime": self._calibrated,
            "CreateLinScale": self._linear_scale,
            "CreateMapScale": self._map_scale,
            "CreateTableScale": self._table_scale,
            "CreatePolynomialScale": self._polynomial_scale,
        }

    def _reset(self, request: Any) -> Fields:
        self._system.reset_device(request.device_name)
        return NOTHING

    def _known_device(self, request: Any) -> Fields:
        self._system.device(request.device_name)
        return NOTHING

    def _supports_calibration(self, request: Any) -> Fields:
        device = self._system.device(request.device_name)
        return {"cal_supported": device.inputs is not None}

    def _calibrated(self, request: Any) -> Fields:
        year, month, day, hour, minute = self._system.device(request.device_name).calibrated
        return {"year": year, "month": month, "day": day, "hour": hour, "minute": minute}

    def _linear_scale(self, request: Any) -> Fields:
        if request.slope == 0:
            raise unsupported_value("Scale_Lin_Slope", 0, "anything but 0")
        units = pick(request, "pre_scaled_units")
        scale = LinearScale(request.name, units, request.scaled_units, request.slope, request.y_intercept)
        self._system.add_scale(scale)
        return NOTHING

    def _map_scale(self, request: Any) -> Fields:
        before = (request.prescaled_min, request.prescaled_max)
        after = (request.scaled_min, request.scaled_max)
        return self._add_table(request, before, after, ScaleType.MAP_RANGES)

    def _table_scale(self, request: Any) -> Fields:
        before, after = tuple(request.prescaled_vals), tuple(request.scaled_vals)
        return self._add_table(request, before, after, ScaleType.TABLE)

    def _add_table(
        self, request: Any, before: tuple[float, ...], after: tuple[float, ...], kind: ScaleType
    ) -> Fields:
        is_sorted = all(list(column) == sorted(set(column)) for column in (before, after))
        if len(before) != len(after) or not is_sorted:
            raise unsupported_value(
                "scale table", request.name, "two columns of equal length, each ascending"
            )
        units = pick(request, "pre_scaled_units")
        self._system.add_scale(TableScale(request.name, units, request.scaled_units, before, after, kind))
        return NOTHING

    def _polynomial_scale(self, request: Any) -> Fields:
        forward, reverse = tuple(request.forward_coeffs), tuple(request.reverse_coeffs)
        units = pick(request, "pre_scaled_units")
        self._system.add_scale(PolynomialScale(request.name, units, request.scaled_units, forward, reverse))
        return NOTHING
