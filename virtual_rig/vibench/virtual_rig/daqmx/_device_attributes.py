"""What a program can ask about the system, its devices and their physical channels."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

from nidaqmx.constants import AcquisitionType, TerminalConfiguration, TriggerUsage, UsageTypeAO

from ..analogue import Coupling
from ._attributes import Attribute, AttributeGroup, not_supported
from ._devices import AnalogInputs, AnalogOutputs, Catalogue, Conversion, Device
from ._names import join

DRIVER_VERSION = (24, 8, 0)
"""Major, minor, update. From 24.5 on the client asks the driver how many samples "all" are."""

_COUPLING_BITS = {Coupling.AC: 1, Coupling.DC: 2}
_TERMINAL_BITS = {
    TerminalConfiguration.RSE: 1,
    TerminalConfiguration.NRSE: 2,
    TerminalConfiguration.DIFF: 4,
    TerminalConfiguration.PSEUDO_DIFF: 8,
}
_TRIGGER_BITS = {
    TriggerUsage.ADVANCE: 1,
    TriggerUsage.PAUSE: 2,
    TriggerUsage.REFERENCE: 4,
    TriggerUsage.START: 8,
}
_SAMPLE_MODES = (AcquisitionType.FINITE, AcquisitionType.CONTINUOUS)
_TIMING_ENGINES = 1

Key = TypeVar("Key")


@dataclass(frozen=True)
class System:
    """The whole simulated system, as the system attributes describe it."""

    catalogue: Catalogue
    scale_names: Callable[[], tuple[str, ...]]


@dataclass(frozen=True)
class PhysicalChannel:
    """One terminal of a device."""

    device: Device
    name: str


def _inputs(device: Device) -> AnalogInputs:
    if device.inputs is None:
        raise not_supported("analogue input", f"Device: {device.name} ({device.product_type})")
    return device.inputs


def _outputs(device: Device) -> AnalogOutputs:
    if device.outputs is None:
        raise not_supported("analogue output", f"Device: {device.name} ({device.product_type})")
    return device.outputs


def _chassis(device: Device) -> str:
    if not device.chassis:
        raise not_supported("CompactDAQ chassis", f"Device: {device.name} ({device.product_type})")
    return device.chassis


def _slot(device: Device) -> int:
    _chassis(device)
    return device.slot


def _bits(keys: tuple[Key, ...], bits: dict[Key, int]) -> int:
    return sum(bits[key] for key in keys)


def _both_signs(ranges_v: tuple[float, ...]) -> list[float]:
    return [limit for full_scale in ranges_v for limit in (-full_scale, full_scale)]


def _highest_total_rate(device: Device) -> float:
    inputs = _inputs(device)
    shared = inputs.count if inputs.conversion is Conversion.MULTIPLEXED else 1
    return inputs.rates.maximum_hz / shared


def _input_triggers(device: Device) -> int:
    reference = (TriggerUsage.REFERENCE,) if device.inputs else ()
    return _bits((*device.trigger_usage, *reference), _TRIGGER_BITS)


SYSTEM = AttributeGroup[System](
    "System",
    {
        "DEV_NAMES": Attribute(lambda system: join(device.name for device in system.catalogue.devices)),
        "TASKS": Attribute(lambda _: ""),  # saved tasks; none can be saved here
        "SCALES": Attribute(lambda system: join(system.scale_names())),
        "GLOBAL_CHANS": Attribute(lambda _: ""),
        "NIDAQ_MAJOR_VERSION": Attribute(lambda _: DRIVER_VERSION[0]),
        "NIDAQ_MINOR_VERSION": Attribute(lambda _: DRIVER_VERSION[1]),
        "NIDAQ_UPDATE_VERSION": Attribute(lambda _: DRIVER_VERSION[2]),
    },
)

DEVICE = AttributeGroup[Device](
    "Device",
    {
        "PRODUCT_TYPE": Attribute(lambda device: device.product_type),
        "PRODUCT_NUM": Attribute(lambda device: device.product_number),
        "PRODUCT_CATEGORY": Attribute(lambda device: device.category),
        "SERIAL_NUM": Attribute(lambda device: device.serial),
        "BUS_TYPE": Attribute(lambda device: device.bus),
        "IS_SIMULATED": Attribute(lambda _: True),
        "ACCESSORY_PRODUCT_TYPES": Attribute(lambda _: ""),
        "ACCESSORY_PRODUCT_NUMS": Attribute(lambda _: []),
        "ACCESSORY_SERIAL_NUMS": Attribute(lambda _: []),
        "CHASSIS_MODULE_DEV_NAMES": Attribute(lambda device: join(device.modules)),
        "COMPACT_DAQ_CHASSIS_DEV_NAME": Attribute(_chassis),
        "COMPACT_DAQ_SLOT_NUM": Attribute(_slot),
        "TERMINALS": Attribute(lambda device: join(device.terminals)),
        "ANLG_TRIG_SUPPORTED": Attribute(
            lambda device: bool(device.inputs and device.inputs.has_analog_trigger)
        ),
        "DIG_TRIG_SUPPORTED": Attribute(lambda device: bool(device.trigger_usage)),
        "TIME_TRIG_SUPPORTED": Attribute(lambda _: False),
        "TEDS_HWTEDS_SUPPORTED": Attribute(lambda _: False),
        "NUM_DMA_CHANS": Attribute(lambda _: 0),
        "DI_LINES": Attribute(lambda _: ""),
        "DI_PORTS": Attribute(lambda _: ""),
        "DO_LINES": Attribute(lambda _: ""),
        "DO_PORTS": Attribute(lambda _: ""),
        "CI_PHYSICAL_CHANS": Attribute(lambda _: ""),
        "CO_PHYSICAL_CHANS": Attribute(lambda _: ""),
        "AI_PHYSICAL_CHANS": Attribute(lambda device: join(device.input_names)),
        "AI_SUPPORTED_MEAS_TYPES": Attribute(lambda device: _inputs(device).measurements),
        "AI_MAX_SINGLE_CHAN_RATE": Attribute(lambda device: _inputs(device).rates.maximum_hz),
        "AI_MAX_MULTI_CHAN_RATE": Attribute(_highest_total_rate),
        "AI_MIN_RATE": Attribute(lambda device: _inputs(device).rates.minimum_hz),
        "AI_SIMULTANEOUS_SAMPLING_SUPPORTED": Attribute(
            lambda device: _inputs(device).conversion is Conversion.SIMULTANEOUS
        ),
        "AI_NUM_SAMP_TIMING_ENGINES": Attribute(lambda device: _TIMING_ENGINES if device.inputs else 0),
        "AI_SAMP_MODES": Attribute(lambda device: _SAMPLE_MODES if device.inputs else ()),
        "AI_TRIG_USAGE": Attribute(_input_triggers),
        "AI_VOLTAGE_RNGS": Attribute(lambda device: _both_signs(_inputs(device).ranges_v)),
        "AI_CURRENT_INT_EXCIT_DISCRETE_VALS": Attribute(
            lambda device: [0.0, *_inputs(device).iepe_currents_a] if _inputs(device).iepe_currents_a else []
        ),
        "AI_VOLTAGE_INT_EXCIT_DISCRETE_VALS": Attribute(lambda _: []),
        "AI_COUPLINGS": Attribute(lambda device: _bits(_inputs(device).couplings, _COUPLING_BITS)),
        "AO_PHYSICAL_CHANS": Attribute(lambda device: join(device.output_names)),
        "AO_SUPPORTED_OUTPUT_TYPES": Attribute(
            lambda device: (UsageTypeAO.VOLTAGE,) if _outputs(device) else ()
        ),
        "AO_MAX_RATE": Attribute(lambda device: _outputs(device).rates.maximum_hz),
        "AO_MIN_RATE": Attribute(lambda device: _outputs(device).rates.minimum_hz),
        "AO_SAMP_CLK_SUPPORTED": Attribute(lambda device: device.outputs is not None),
        "AO_NUM_SAMP_TIMING_ENGINES": Attribute(lambda device: _TIMING_ENGINES if device.outputs else 0),
        "AO_SAMP_MODES": Attribute(lambda device: _SAMPLE_MODES if device.outputs else ()),
        "AO_TRIG_USAGE": Attribute(
            lambda device: _bits(device.trigger_usage, _TRIGGER_BITS) if device.outputs else 0
        ),
        "AO_VOLTAGE_RNGS": Attribute(lambda device: _both_signs((_outputs(device).range_v,))),
    },
)

PHYSICAL_CHANNEL = AttributeGroup[PhysicalChannel](
    "PhysicalChannel",
    {
        "PHYSICAL_CHAN_AI_SUPPORTED_MEAS_TYPES": Attribute(
            lambda channel: _inputs(channel.device).measurements
        ),
        "PHYSICAL_CHAN_AI_TERM_CFGS": Attribute(
            lambda channel: _bits(_inputs(channel.device).terminals, _TERMINAL_BITS)
        ),
        "PHYSICAL_CHAN_AI_INPUT_SRCS": Attribute(lambda channel: channel.name),
        "PHYSICAL_CHAN_AO_SUPPORTED_OUTPUT_TYPES": Attribute(
            lambda channel: (UsageTypeAO.VOLTAGE,) if _outputs(channel.device) else ()
        ),
        "PHYSICAL_CHAN_AO_TERM_CFGS": Attribute(
            lambda channel: _TERMINAL_BITS[_outputs(channel.device).terminal]
        ),
    },
)
CALIBRATION = AttributeGroup[Device](
    "CalibrationInfo",
    {
        "SELF_CAL_SUPPORTED": Attribute(lambda device: not device.chassis and not device.modules),
        "EXT_CAL_RECOMMENDED_INTERVAL": Attribute(lambda device: device.calibration_interval_months),
    },
)
