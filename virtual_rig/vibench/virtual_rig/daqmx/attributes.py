"""Table of all properties of system, devices, tasks and channels that a program can read or set.

Names are as in NI's protocol file (`nidaqmx.proto`); the NI-DAQmx help describes each property.
"""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import Enum
from functools import cached_property, partial
from typing import Any

from nidaqmx._stubs import nidaqmx_pb2
from nidaqmx.constants import (
    ChannelType,
    Coupling as WireCoupling,
    ExcitationSource,
    ExcitationVoltageOrCurrent,
    RegenerationMode,
    UsageTypeAI,
)
from nidaqmx.error_codes import DAQmxErrors

from ..world.conversion import Coupling
from .calls import DaqmxSystem, Fields
from .data_calls import count_available, default_samples
from .devices import AnalogInputs, Device, OutputChannel
from .errors import DaqmxRefusal, member, unsupported_value
from .streams import Acquisition, check_memory
from .tasks import Task, TaskState

DRIVER_VERSION = (24, 8, 0)
"""Major, minor and update number. From 24.5 on, nidaqmx asks the driver how many samples "all" stands for."""


@dataclass(frozen=True)
class Attribute:
    """One property: how a program reads the property and, if it is writable, how a program sets it."""

    get: Callable[[Any], object]
    set: Callable[[Any, Any], None] | None = None


Attributes = Mapping[str, Attribute]


@dataclass(frozen=True)
class Group:
    """The properties of one type of object, such as tasks or channels."""

    name: str
    """Prefix of these properties' names in the protocol."""
    subjects: Callable[[DaqmxSystem, Any], list[Any]]
    """Function that returns the objects of a request; ``get`` uses only the first, ``set`` uses all."""
    attributes: Callable[[Any], Attributes]
    is_set_at_rest: bool = False
    """Whether these properties are read-only while the task runs."""

    @cached_property
    def names(self) -> dict[int, str]:
        """Names of the properties by their numbers in the protocol."""
        return {
            value.number: value.name.rpartition("_ATTRIBUTE_")[2]
            for name, numbers in nidaqmx_pb2.DESCRIPTOR.enum_types_by_name.items()
            if name.startswith(self.name)
            and name.endswith("Attribute")
            and not name.endswith("ResetAttribute")
            for value in numbers.values
        }

    def find(self, subject: Any, request: Any) -> tuple[str, Attribute]:
        """Return name and property for the number in a request (-200197 if the object has none)."""
        number = int(request.attribute_raw or request.attribute)
        name = self.names.get(number, f"0x{number:X}")
        attributes = self.attributes(subject)
        if name not in attributes:
            raise not_supported(f"{self.name}.{name}", "The simulated driver does not have this property.")
        return f"{self.name}.{name}", attributes[name]


# Functions that read and write properties


def _field(name: str, convert: Callable[[Any], object] = lambda value: value) -> Callable[[Any, Any], None]:
    """Return a function that sets a field of a channel or task."""

    def write(thing: object, value: object) -> None:
        setattr(thing, name, convert(value))

    return write


def _require(property_name: str, allowed: Callable[[Any], Enum]) -> Callable[[Any, int], None]:
    """Return a function that accepts the only supported value and refuses other values."""

    def write(thing: object, code: int) -> None:
        if code != allowed(thing).value:
            raise unsupported_value(property_name, code, allowed(thing).name)

    return write


def not_supported(name: str, where: str) -> DaqmxRefusal:
    """Return the error for an attribute that a device, channel or task does not have (-200197)."""
    return DaqmxRefusal(DAQmxErrors.ATTR_NOT_SUPPORTED, f"Property: {name}\n{where}")


def _output_range(device: Device) -> list[float]:
    if device.outputs is None:
        raise not_supported("analogue output", f"Device: {device.name} ({device.product_type})")
    return [-device.outputs.range_v, device.outputs.range_v]


def _start_terminal(task: Task) -> str:
    terminal = task.start_terminal
    # A chassis assigns a timing engine only when a task is reserved.
    if any(device.chassis for device in task.devices) and task.state < TaskState.RESERVED:
        raise task.refusal(DAQmxErrors.CANNOT_GET_PROPERTY_WHEN_TASK_NOT_RESERVED_COMMITTED_OR_RUNNING)
    return terminal


def _running_acquisition(task: Task) -> Acquisition:
    """Return the running acquisition of a task; the task's device must detect overloads."""
    if not (isinstance(task.side, AnalogInputs) and task.side.detects_overloads):
        device = task.devices[0]
        raise not_supported("Read.OVERLOADED_CHANS_EXIST", f"Device: {device.name} ({device.product_type})")
    if task.acquisition is None:
        raise task.refusal(DAQmxErrors.CANT_GET_PROPERTY_TASK_NOT_RUNNING)
    return task.acquisition


def _has_overloads(task: Task) -> bool:
    acquisition = _running_acquisition(task)
    acquisition.look_for_overloads()
    return bool(acquisition.overloaded.any())


def _overloaded_names(task: Task) -> str:
    flags = _running_acquisition(task).overloaded
    return ", ".join(channel.name for channel, is_over in zip(task.inputs, flags, strict=True) if is_over)


def _set_regeneration(task: Task, mode: int) -> None:
    task.require_stopped()
    task.regeneration = member(RegenerationMode, mode, "Write_RegenMode")


def _set_output_buffer(task: Task, size: int) -> None:
    check_memory(size, len(task.outputs))
    task.output_size = size
    task.buffer = None


def _channel_names(task: Task) -> str:
    return ", ".join(channel.name for channel in task.channels)


# fmt: off
SYSTEM: Attributes = {
    "DEV_NAMES": Attribute(lambda system: ", ".join(each.name for each in system.rig.catalogue.devices)),
    "NIDAQ_MAJOR_VERSION": Attribute(lambda _: DRIVER_VERSION[0]),
    "NIDAQ_MINOR_VERSION": Attribute(lambda _: DRIVER_VERSION[1]),
    "NIDAQ_UPDATE_VERSION": Attribute(lambda _: DRIVER_VERSION[2]),
}
DEVICE: Attributes = {
    "PRODUCT_TYPE": Attribute(lambda device: device.product_type),
    "PRODUCT_CATEGORY": Attribute(lambda device: device.category),
    "SERIAL_NUM": Attribute(lambda device: device.serial),
    "IS_SIMULATED": Attribute(lambda _: True),
    "AI_PHYSICAL_CHANS": Attribute(lambda device: ", ".join(device.input_names)),
    "AO_PHYSICAL_CHANS": Attribute(lambda device: ", ".join(device.output_names)),
    "AO_VOLTAGE_RNGS": Attribute(_output_range),
}
TASK: Attributes = {
    "NAME": Attribute(lambda task: task.name),
    "CHANNELS": Attribute(_channel_names),
    "DEVICES": Attribute(lambda task: ", ".join(device.name for device in task.devices)),
}
TIMING: Attributes = {
    "SAMP_CLK_RATE": Attribute(lambda task: task.rate_hz),
    "SAMP_TIMING_TYPE": Attribute(lambda task: task.kind),
}
TRIGGER: Attributes = {
    "START_TRIG_TERM": Attribute(_start_terminal),
}
READ: Attributes = {
    "CHANNELS_TO_READ": Attribute(_channel_names),
    "NUM_CHANS": Attribute(lambda task: len(task.channels)),
    "AVAIL_SAMP_PER_CHAN": Attribute(count_available),
    "0x31E8": Attribute(default_samples),  # number of samples that "all" means; has no name in the protocol
    "OVERLOADED_CHANS_EXIST": Attribute(_has_overloads),
    "OVERLOADED_CHANS": Attribute(_overloaded_names),
}
WRITE: Attributes = {
    "NUM_CHANS": Attribute(lambda task: len(task.outputs)),
    "REGEN_MODE": Attribute(lambda task: task.regeneration, _set_regeneration),
}
BUFFER: Attributes = {
    "OUTPUT_BUF_SIZE": Attribute(lambda task: task.output_buffer.size, _set_output_buffer),
}
INPUT: Attributes = {
    "PHYSICAL_CHAN_NAME": Attribute(lambda channel: channel.physical),
    "CHAN_TYPE": Attribute(lambda _: ChannelType.ANALOG_INPUT),
    "AI_MEAS_TYPE": Attribute(lambda _: UsageTypeAI.VOLTAGE),
    "AI_MAX": Attribute(lambda channel: channel.maximum, _field("maximum")),
    "AI_MIN": Attribute(lambda channel: channel.minimum, _field("minimum")),
    "AI_RNG_HIGH": Attribute(lambda channel: channel.range_v),
    "AI_RNG_LOW": Attribute(lambda channel: -channel.range_v),
    "AI_COUPLING": Attribute(
        lambda channel: WireCoupling[channel.actual_coupling.name],
        _field("coupling", lambda code: Coupling(member(WireCoupling, code, "AI_Coupling").name))),
    "AI_EXCIT_SRC": Attribute(lambda channel: channel.excitation,
        _field("excitation", lambda code: member(ExcitationSource, code, "AI_Excit_Src"))),
    "AI_EXCIT_VAL": Attribute(lambda channel: channel.excitation_a, _field("excitation_a")),
    "AI_EXCIT_VOLTAGE_OR_CURRENT": Attribute(lambda _: ExcitationVoltageOrCurrent.USE_CURRENT,
        _require("AI_Excit_VoltageOrCurrent", lambda _: ExcitationVoltageOrCurrent.USE_CURRENT)),
    "AI_RAW_SAMP_SIZE": Attribute(lambda channel: channel.raw_bits),
    "AI_DEV_SCALING_COEFF": Attribute(lambda channel: [0.0, channel.volts_per_count, 0.0, 0.0]),
}
OUTPUT: Attributes = {
    "PHYSICAL_CHAN_NAME": Attribute(lambda channel: channel.physical),
    "CHAN_TYPE": Attribute(lambda _: ChannelType.ANALOG_OUTPUT),
    "AO_MAX": Attribute(lambda channel: channel.maximum, _field("maximum")),
    "AO_MIN": Attribute(lambda channel: channel.minimum, _field("minimum")),
    "AO_IDLE_OUTPUT_BEHAVIOR": Attribute(lambda channel: channel.side.idle,
        _require("AO_IdleOutputBehavior", lambda channel: channel.side.idle)),
}
# fmt: on


def _task(system: DaqmxSystem, request: Any) -> list[Any]:
    return [system.task(request.task.name)]


def _channels(system: DaqmxSystem, request: Any) -> list[Any]:
    task = system.task(request.task.name)
    task.require_channels()
    return task.find(request.channel)


GROUPS = {
    "SystemInfo": Group("System", lambda system, _: [system], lambda _: SYSTEM),
    "Device": Group(
        "Device", lambda system, request: [system.rig.catalogue.device(request.device_name)], lambda _: DEVICE
    ),
    "Task": Group("Task", _task, lambda _: TASK),
    "Timing": Group("Timing", _task, lambda _: TIMING),
    "Trig": Group("Trigger", _task, lambda _: TRIGGER),
    "Read": Group("Read", _task, lambda _: READ),
    "Write": Group("Write", _task, lambda _: WRITE),
    "Buffer": Group("Buffer", _task, lambda _: BUFFER, is_set_at_rest=True),
    "Chan": Group(
        "Channel",
        _channels,
        lambda channel: OUTPUT if isinstance(channel, OutputChannel) else INPUT,
        is_set_at_rest=True,
    ),
}
"""Groups of properties, keyed by the part of the protocol's call names that denotes them."""


# Tables that map calls to properties, and values to messages

SERVICE = nidaqmx_pb2.DESCRIPTOR.services_by_name["NiDAQmx"]
_CALL = re.compile(r"^(?P<verb>Get|Set)(?P<scope>[A-Za-z]+?)Attribute[A-Z]\w*$")


def attribute_calls(system: DaqmxSystem) -> dict[str, Callable[[Any], Fields]]:
    """Return the calls that get and set properties of these groups, keyed by name in the protocol."""
    calls: dict[str, Callable[[Any], Fields]] = {}
    for method in SERVICE.methods:
        found = _CALL.match(method.name)
        if found and found["scope"] in GROUPS:
            group = GROUPS[found["scope"]]
            if found["verb"] == "Set":
                calls[method.name] = partial(_set, system, group)
            else:
                has_raw = "value_raw" in method.output_type.fields_by_name
                calls[method.name] = partial(_get, system, group, "value_raw" if has_raw else "value")
    return calls


def _get(system: DaqmxSystem, group: Group, field: str, request: Any) -> Fields:
    subject = group.subjects(system, request)[0]
    value = group.find(subject, request)[1].get(subject)
    return {field: value.value if isinstance(value, Enum) else value}


def _set(system: DaqmxSystem, group: Group, request: Any) -> Fields:
    if group.is_set_at_rest:
        system.task(request.task.name).require_stopped()
    for subject in group.subjects(system, request):
        name, attribute = group.find(subject, request)
        if attribute.set is None:
            raise not_supported(name, "It can only be read.")
        has_raw = "value_raw" in request.DESCRIPTOR.fields_by_name
        attribute.set(subject, (has_raw and request.value_raw) or request.value)
    return {}
