from ._afg1022x import (
    AFG1022X as AFG1022X,
)
from ._daqmx import (
    DaqmxDigitizer as DaqmxDigitizer,
    list_daqmx_devices as list_daqmx_devices,
)
from ._daqmx_output import (
    DaqmxOutput as DaqmxOutput,
)
from ._limits import (
    AFG1022_MODEL as AFG1022_MODEL,
    NO_GENERATOR as NO_GENERATOR,
    ArbitraryCodes as ArbitraryCodes,
    GeneratorModel as GeneratorModel,
    NoGenerator as NoGenerator,
    Shape as Shape,
    overload_ranges as overload_ranges,
    require_playable as require_playable,
)
from ._scpi import (
    SWITCH as SWITCH,
    Link as Link,
    Number as Number,
    Word as Word,
    list_visa_resources as list_visa_resources,
    open_link as open_link,
)
