"""Read hardware configurations, and find the drivers and fault scripts that they name."""

from pathlib import Path
from typing import Any, Protocol, cast

from ..errors import ConfigurationError
from ..host.installation import file_path
from ..host.toml_file import load_toml
from ..instruments import (
    AnalogOutput,
    Digitizer,
    FunctionGenerator,
    GeneratorDescription,
    PlugInKind,
    driver_of,
    require_plug_in,
)
from ._configuration import GeneratorConfig, OutputConfig, Rig
from ._knobs import sensor_name


def load_rig(path: Path | str) -> Rig:
    """Return the rig in a TOML file, or a shipped rig by its name (``"virtual_rig"``).

    Raises ConfigurationError with file, key, given value and allowed values.
    """
    path = file_path(path, "hardware_configs")
    rig = load_toml(path, Rig)
    for (kind, name), key in plug_ins_of(rig).items():
        require_plug_in(kind, name, f"{path}: {key} = ")
    if rig.virtual is None or rig.virtual.faults is None:
        return rig
    return with_faults(rig, path.absolute().parent / rig.virtual.faults)


def plug_ins_of(rig: Rig) -> dict[tuple[PlugInKind, str], str]:
    """Return the plug-ins that a hardware configuration names: the key of each plug-in, by kind and name."""
    named = {
        (PlugInKind.GENERATOR, rig.generator.driver): "generator.driver",
        (PlugInKind.DIGITIZER, rig.daq.driver): "daq.driver",
        **{(PlugInKind.SENSOR, sensor_name(each)): "daq.channels.sensor" for each in rig.daq.channels},
    }
    if rig.controller is not None:
        named[PlugInKind.CONTROLLER, rig.controller.driver] = "controller.driver"
    if rig.daq.output is not None:
        named[PlugInKind.OUTPUT, rig.daq.driver] = "daq.driver (of the output)"
    return named


def with_faults(rig: Rig, script: Path) -> Rig:
    """Return a virtual rig in which the faults of ``script`` occur.

    Raises ConfigurationError when the rig is real.
    """
    if rig.virtual is None:
        raise ConfigurationError(
            f"{script}: faults can be scripted only on a virtual rig, and {rig.name!r} is a real rig. "
            "Nothing was opened; leave the script out, or give a rig with a [virtual] table"
        )
    script = file_path(script, "hardware_configs/faults")
    scripted = rig.virtual.model_copy(update={"faults": str(script.absolute())})
    return rig.model_copy(update={"virtual": scripted})


class GeneratorDriver(Protocol):
    """Entry point of ``vibench.generators``: an object, usually a class, with these two methods."""

    def describe(self, config: GeneratorConfig) -> GeneratorDescription:
        """Return the capabilities of the generator with this configuration, without opening it."""

    def open(self, config: GeneratorConfig) -> FunctionGenerator:
        """Open and return a generator with its output off and its smallest amplitude set.

        Raises InstrumentError, and closes all connections, if no instrument or a wrong instrument responds.
        """


class DigitizerDriver(Protocol):
    """Entry point of ``vibench.digitizers``."""

    def open(self, rig: Rig) -> Digitizer:
        """Reserve a converter with the channels of ``rig.daq``, read each setting back, and return it."""


class OutputDriver(Protocol):
    """Entry point of ``vibench.outputs``, registered under the name of the digitizer driver."""

    def open(self, physical: str, config: OutputConfig, digitizer: Any) -> AnalogOutput:
        """Set an output to zero volts, reserve it and return it.

        ``physical`` is the full name of the output, such as ``"Dev1/ao0"``. The output starts together with
        ``digitizer``, which the driver of the same name has opened.
        """


def generator_driver(config: GeneratorConfig) -> GeneratorDriver:
    """Return the driver of a generator; raises ConfigurationError if the driver is not installed."""
    return cast("GeneratorDriver", driver_of(PlugInKind.GENERATOR, config.driver, GeneratorDriver))


def digitizer_driver(rig: Rig) -> DigitizerDriver:
    """Return the driver of a converter; raises ConfigurationError if the driver is not installed."""
    return cast("DigitizerDriver", driver_of(PlugInKind.DIGITIZER, rig.daq.driver, DigitizerDriver))


def output_driver(rig: Rig) -> OutputDriver:
    """Return the driver of an analogue output; raises ConfigurationError if the driver is not installed."""
    return cast("OutputDriver", driver_of(PlugInKind.OUTPUT, rig.daq.driver, OutputDriver))
