"""What a program can ask and set about a task: timing, trigger, reading, writing, buffers."""

from nidaqmx.constants import (
    AcquisitionType,
    Edge,
    OverwriteMode,
    ReadRelativeTo,
    RegenerationMode,
    SampleTimingType,
    TriggerType,
    WriteRelativeTo,
)
from nidaqmx.error_codes import DAQmxErrors

from ._acquisition import Acquisition
from ._attributes import Attribute, AttributeGroup, not_supported
from ._devices import AnalogInputs, Overloads
from ._errors import DaqmxRefusal, member, unsupported_value
from ._names import expand, join
from ._reading import asked_available, available, default_samples
from ._tasks import Task, TaskState
from ._timing import ReferenceTrigger, check_memory, check_samples

_DEFAULT_SAMPLES_TO_READ = "0x31E8"
"""Not named in the protocol: how many samples a read of "all" brings."""

_BITS_PER_BYTE = 8
_OF_A_REFERENCE = (ReadRelativeTo.REFERENCE_TRIGGER, ReadRelativeTo.FIRST_PRETRIGGER_SAMPLE)


def _name_known_terminal(task: Task, terminal: str) -> str:
    if task.is_on_chassis and task.state < TaskState.RESERVED:
        code = DAQmxErrors.CANNOT_GET_PROPERTY_WHEN_TASK_NOT_RESERVED_COMMITTED_OR_RUNNING
        raise DaqmxRefusal(code, f"Task Name: {task.name}\nReserve the task first.")
    return terminal


def _set_rate(task: Task, rate_hz: float) -> None:
    task.timing.requested_hz = rate_hz
    task.timing.kind = SampleTimingType.SAMPLE_CLOCK


def _set_kind(task: Task, kind: int) -> None:
    allowed = (SampleTimingType.SAMPLE_CLOCK, SampleTimingType.ON_DEMAND)
    if kind not in [option.value for option in allowed]:
        raise unsupported_value("SampTimingType", kind, "SAMPLE_CLOCK, ON_DEMAND")
    task.timing.kind = SampleTimingType(kind)


def _set_mode(task: Task, mode: int) -> None:
    if mode not in (AcquisitionType.FINITE.value, AcquisitionType.CONTINUOUS.value):
        raise unsupported_value("SampQuant_SampMode", mode, "FINITE, CONTINUOUS")
    task.timing.mode = AcquisitionType(mode)


def _set_samples(task: Task, samples: int) -> None:
    task.timing.samples = check_samples(samples)


def _set_source(task: Task, source: str) -> None:
    task.timing.clock_source = source


def _set_edge(task: Task, edge: int) -> None:
    task.timing.clock_edge = member(Edge, edge, "SampClk_ActiveEdge")


TIMING = AttributeGroup[Task](
    "Timing",
    {
        "SAMP_CLK_RATE": Attribute(lambda task: task.rate_hz, _set_rate, initial=1000.0),
        "SAMP_CLK_MAX_RATE": Attribute(lambda task: task.side.rates.maximum_hz),
        "SAMP_TIMING_TYPE": Attribute(lambda task: task.kind, _set_kind),
        "SAMP_QUANT_SAMP_MODE": Attribute(lambda task: task.timing.mode, _set_mode, initial=10178),
        "SAMP_QUANT_SAMP_PER_CHAN": Attribute(lambda task: task.timing.samples, _set_samples, initial=1000),
        "SAMP_CLK_SRC": Attribute(lambda task: task.timing.clock_source or task.clock_terminal, _set_source),
        "SAMP_CLK_ACTIVE_EDGE": Attribute(lambda task: task.timing.clock_edge, _set_edge),
        "SAMP_CLK_TERM": Attribute(lambda task: _name_known_terminal(task, task.clock_terminal)),
    },
)


def _set_trigger_type(task: Task, kind: int) -> None:
    if kind == TriggerType.NONE.value:
        task.timing.trigger_source = ""
    elif kind != TriggerType.DIGITAL_EDGE.value:
        raise unsupported_value("StartTrig_Type", kind, "NONE, DIGITAL_EDGE")


def _trigger_type(task: Task) -> TriggerType:
    return TriggerType.DIGITAL_EDGE if task.timing.trigger_source else TriggerType.NONE


def set_trigger_source(task: Task, source: str) -> None:
    """Wait for that terminal, given as ``"/Dev1/PFI0"``, or ``"PFI0"`` of the task's own device."""
    task.timing.trigger_source = full_terminal(task, source)


def full_terminal(task: Task, source: str) -> str:
    """Name a terminal with its device: ``"PFI0"`` is one of the task's own."""
    task.require_channels()
    return source if source.startswith("/") else f"/{task.devices[0].clock_name}/{source}"


def _reference_type(task: Task) -> TriggerType:
    match task.timing.reference:
        case None:
            return TriggerType.NONE
        case ReferenceTrigger(level=None):
            return TriggerType.DIGITAL_EDGE
        case _:
            return TriggerType.ANALOG_EDGE


def _reference(task: Task) -> ReferenceTrigger:
    if task.timing.reference is None:
        raise DaqmxRefusal(DAQmxErrors.NO_REF_TRIG_CONFIGURED, f"Task Name: {task.name}")
    return task.timing.reference


def _set_trigger_edge(task: Task, edge: int) -> None:
    task.timing.trigger_edge = member(Edge, edge, "DigEdge_StartTrig_Edge")


TRIGGER = AttributeGroup[Task](
    "Trigger",
    {
        "START_TRIG_TYPE": Attribute(_trigger_type, _set_trigger_type, initial=TriggerType.NONE.value),
        "START_TRIG_TERM": Attribute(lambda task: _name_known_terminal(task, task.start_terminal)),
        "DIG_EDGE_START_TRIG_SRC": Attribute(lambda task: task.timing.trigger_source, set_trigger_source),
        "DIG_EDGE_START_TRIG_EDGE": Attribute(lambda task: task.timing.trigger_edge, _set_trigger_edge),
        "REF_TRIG_TYPE": Attribute(_reference_type),
        "REF_TRIG_PRETRIG_SAMPLES": Attribute(lambda task: _reference(task).pretrigger),
        "DIG_EDGE_REF_TRIG_SRC": Attribute(lambda task: _reference(task).source),
        "DIG_EDGE_REF_TRIG_EDGE": Attribute(lambda task: _reference(task).slope),
        "ANLG_EDGE_REF_TRIG_SRC": Attribute(lambda task: _reference(task).source),
        "ANLG_EDGE_REF_TRIG_SLOPE": Attribute(lambda task: _reference(task).slope),
        "ANLG_EDGE_REF_TRIG_LVL": Attribute(lambda task: _reference(task).level or 0.0),
        "PAUSE_TRIG_TYPE": Attribute(lambda _: TriggerType.NONE),
        "ARM_START_TRIG_TYPE": Attribute(lambda _: TriggerType.NONE),
        "START_TRIG_RETRIGGERABLE": Attribute(lambda _: False),
    },
)


def _is_complete(task: Task) -> bool:
    if task.is_running and not task.is_done():
        task.rig.pace.answer_progress(task.rig)
    return task.is_done()


TASK = AttributeGroup[Task](
    "Task",
    {
        "NAME": Attribute(lambda task: task.name),
        "CHANNELS": Attribute(lambda task: join(channel.name for channel in task.channels)),
        "NUM_CHANS": Attribute(lambda task: len(task.channels)),
        "DEVICES": Attribute(lambda task: join(device.name for device in task.devices)),
        "NUM_DEVICES": Attribute(lambda task: len(task.devices)),
        "COMPLETE": Attribute(_is_complete),
    },
)


def _running(task: Task) -> Acquisition:
    if task.acquisition is None:
        raise DaqmxRefusal(DAQmxErrors.CANT_GET_PROPERTY_TASK_NOT_RUNNING, f"Task Name: {task.name}")
    return task.acquisition


def _require_overload_detection(task: Task) -> None:
    side = task.side
    match side:
        case AnalogInputs(overloads=Overloads.DETECTED):
            return
        case _:
            product = task.devices[0].product_type
            raise not_supported("Read.OVERLOADED_CHANS_EXIST", f"Device: {task.devices[0].name} ({product})")


def _overloads_exist(task: Task) -> bool:
    _require_overload_detection(task)
    acquisition = _running(task)
    acquisition.look_for_overloads()
    return bool(acquisition.overloaded.any())


def _overloaded_names(task: Task) -> str:
    _require_overload_detection(task)
    flags = _running(task).overloaded
    return join(channel.name for channel, is_over in zip(task.inputs, flags, strict=True) if is_over)


def _total_acquired(task: Task) -> int:
    available(task)
    return task.acquisition.acquired if task.acquisition else 0


def _set_overwrite(task: Task, mode: int) -> None:
    task.reading.overwrite = OverwriteMode(mode)


def _set_relative_to(task: Task, origin: int) -> None:
    relative_to = member(ReadRelativeTo, origin, "Read_RelativeTo")
    if relative_to in _OF_A_REFERENCE and task.timing.reference is None:
        raise DaqmxRefusal(DAQmxErrors.NO_REF_TRIG_CONFIGURED, f"Task Name: {task.name}")
    task.reading.relative_to = relative_to


def _set_offset(task: Task, offset: int) -> None:
    task.reading.offset = offset


def _set_starts_by_itself(task: Task, starts: bool) -> None:  # noqa: FBT001 - the protocol's type
    task.reading.starts_by_itself = starts


def _set_reads_all(task: Task, reads_all: bool) -> None:  # noqa: FBT001 - the protocol's type
    task.reading.reads_all_available = reads_all


def _set_channels(task: Task, names: str) -> None:
    task.find(names)
    task.reading.channels = expand(names)


READ = AttributeGroup[Task](
    "Read",
    {
        "CHANNELS_TO_READ": Attribute(lambda task: join(task.channels_to_read), _set_channels, initial=""),
        "NUM_CHANS": Attribute(lambda task: len(task.channels_to_read)),
        "CURR_READ_POS": Attribute(lambda task: task.acquisition.position if task.acquisition else 0),
        "TOTAL_SAMP_PER_CHAN_ACQUIRED": Attribute(_total_acquired),
        "AVAIL_SAMP_PER_CHAN": Attribute(asked_available),
        _DEFAULT_SAMPLES_TO_READ: Attribute(default_samples),
        "RAW_DATA_WIDTH": Attribute(lambda task: _raw_width(task) * len(task.channels_to_read)),
        "OVERLOADED_CHANS_EXIST": Attribute(_overloads_exist),
        "OVERLOADED_CHANS": Attribute(_overloaded_names),
        "OVERWRITE": Attribute(lambda task: task.reading.overwrite, _set_overwrite, initial=10159),
        "RELATIVE_TO": Attribute(lambda task: task.reading.relative_to, _set_relative_to, initial=10425),
        "OFFSET": Attribute(lambda task: task.reading.offset, _set_offset, initial=0),
        "AUTO_START": Attribute(
            lambda task: task.reading.starts_by_itself, _set_starts_by_itself, initial=True
        ),
        "READ_ALL_AVAIL_SAMP": Attribute(
            lambda task: task.reading.reads_all_available, _set_reads_all, initial=False
        ),
    },
)


def _raw_width(task: Task) -> int:
    is_short = task.side.bits <= 2 * _BITS_PER_BYTE
    return 2 if is_short else 4


def _total_generated(task: Task) -> int:
    if task.generation is None:
        return 0
    task.rig.pace.answer_progress(task.rig)
    return task.generation.generated


def _space(task: Task) -> int:
    if task.generation is not None:
        return task.generation.space
    return task.output_buffer.size - task.output_buffer.filled


def _set_regeneration(task: Task, mode: int) -> None:
    task.require_stopped()
    task.writing.regeneration = RegenerationMode(mode)


WRITE = AttributeGroup[Task](
    "Write",
    {
        "REGEN_MODE": Attribute(lambda task: task.writing.regeneration, _set_regeneration, initial=10097),
        "SPACE_AVAIL": Attribute(_space),
        "CURR_WRITE_POS": Attribute(lambda task: task.output_buffer.written),
        "TOTAL_SAMP_PER_CHAN_GENERATED": Attribute(_total_generated),
        "NUM_CHANS": Attribute(lambda task: len(task.outputs)),
        "RAW_DATA_WIDTH": Attribute(lambda task: _raw_width(task) * len(task.outputs)),
        "RELATIVE_TO": Attribute(lambda _: WriteRelativeTo.CURRENT_WRITE_POSITION),
        "OFFSET": Attribute(lambda _: 0),
    },
)


def _set_input_buffer(task: Task, size: int) -> None:
    task.reading.buffer_size = size


def set_output_buffer(task: Task, size: int) -> None:
    """Give the task an output buffer of that size, empty."""
    task.require_stopped()
    check_memory(size, len(task.outputs))
    task.writing.buffer_size = size
    task.buffer = None


BUFFER = AttributeGroup[Task](
    "Buffer",
    {
        "INPUT_BUF_SIZE": Attribute(lambda task: task.buffer_size, _set_input_buffer),
        "OUTPUT_BUF_SIZE": Attribute(lambda task: task.output_buffer.size, set_output_buffer),
    },
)
