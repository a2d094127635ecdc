"""Which driver opens an instrument of a rig: the plug-in that its configuration names."""

from typing import Any, Protocol, cast

from ..instruments import (
    AnalogOutput,
    Digitizer,
    FunctionGenerator,
    GeneratorDescription,
    PlugInKind,
    RealTimeController,
    driver_of,
)
from ._configuration import ControllerConfig, GeneratorConfig, Rig
from ._output import OutputConfig


class GeneratorDriver(Protocol):
    """What an entry point of ``vibench.generators`` is: a class, mostly, with both as class methods."""

    def describe(self, config: GeneratorConfig) -> GeneratorDescription:
        """Say what the generator can do with this configuration; nothing is opened."""

    def open(self, config: GeneratorConfig) -> FunctionGenerator:
        """Open a generator, its output off, at its smallest amplitude.

        Raises
        ------
        InstrumentError
            When none answers, or another one; nothing stays open then.

        """


class DigitizerDriver(Protocol):
    """What an entry point of ``vibench.digitizers`` is."""

    def open(self, rig: Rig) -> Digitizer:
        """Reserve a converter with the channels of ``rig.daq``, each setting read back."""


class OutputDriver(Protocol):
    """What an entry point of ``vibench.outputs`` is; it has the name of the digitizer that it starts with."""

    def open(self, physical: str, config: OutputConfig, digitizer: Any) -> AnalogOutput:
        """Set an output to zero volts and reserve it.

        Parameters
        ----------
        physical
            Full name: ``"Dev1/ao0"``.
        digitizer
            What the digitizer's driver of the same name has opened; both start together.

        """


class ControllerDriver(Protocol):
    """What an entry point of ``vibench.controllers`` is."""

    def open(self, config: ControllerConfig) -> RealTimeController:
        """Connect to a controller, silent; raises InstrumentError where none answers, or another one."""


def controller_driver(config: ControllerConfig) -> ControllerDriver:
    """Find the driver of a real-time controller; raises ConfigurationError where none is installed."""
    return cast("ControllerDriver", driver_of(PlugInKind.CONTROLLER, config.driver, ControllerDriver))


def generator_driver(config: GeneratorConfig) -> GeneratorDriver:
    """Find the driver of a generator; raises ConfigurationError where none is installed."""
    return cast("GeneratorDriver", driver_of(PlugInKind.GENERATOR, config.driver, GeneratorDriver))


def digitizer_driver(rig: Rig) -> DigitizerDriver:
    """Find the driver of a converter; raises ConfigurationError where none is installed."""
    return cast("DigitizerDriver", driver_of(PlugInKind.DIGITIZER, rig.daq.driver, DigitizerDriver))


def output_driver(rig: Rig) -> OutputDriver:
    """Find the driver of an analogue output; raises ConfigurationError where none is installed."""
    return cast("OutputDriver", driver_of(PlugInKind.OUTPUT, rig.daq.driver, OutputDriver))
