"""Which driver opens an instrument: a row for each word that a rig's TOML file gives as ``driver``."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

from ..drivers import AFG1022X, DaqmxDigitizer, DaqmxOutput
from ..instruments import AnalogOutput
from ..rig import GeneratorConfig, OutputConfig, Rig
from ._protocol import CountingDigitizer, VerifiedGenerator

GENERATOR_DRIVERS: Mapping[str, Callable[[GeneratorConfig], VerifiedGenerator]] = MappingProxyType(
    {"afg1022x": AFG1022X.open}
)
"""Open a function generator, its output off."""


@dataclass(frozen=True)
class DaqDriver:
    """Opens a converter, and an analogue output beside it."""

    digitizer: Callable[[Rig], CountingDigitizer]
    output: Callable[[str, OutputConfig, Any], AnalogOutput]
    """Of its full name, its table, and the driver's own digitizer, with which it starts."""


DAQ_DRIVERS: Mapping[str, DaqDriver] = MappingProxyType(
    {"daqmx": DaqDriver(DaqmxDigitizer.open, DaqmxOutput.open)}
)
