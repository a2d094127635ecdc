from ._guarded import (
    PlugInKind as PlugInKind,
    driver_of as driver_of,
    missing_package as missing_package,
    plug_in as plug_in,
    plug_in_names as plug_in_names,
)
from ._protocols import (
    AnalogOutput as AnalogOutput,
    Digitizer as Digitizer,
    FunctionGenerator as FunctionGenerator,
    GeneratorDescription as GeneratorDescription,
    IdleOutput as IdleOutput,
    RealTimeController as RealTimeController,
    Spacing as Spacing,
    Sweep as Sweep,
    read_block as read_block,
)
from ._values import (
    Block as Block,
    Counts as Counts,
    FoundDevice as FoundDevice,
    Identity as Identity,
    Knob as Knob,
    Overload as Overload,
    Samples as Samples,
    SensorFacts as SensorFacts,
)
