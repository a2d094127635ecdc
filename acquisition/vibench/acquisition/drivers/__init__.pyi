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
from ._file_player import (
    FilePlayer as FilePlayer,
)
from ._generator_limits import (
    AFG1022_MODEL as AFG1022_MODEL,
    FILE_GENERATOR as FILE_GENERATOR,
    KEYSIGHT_33500B_MODEL as KEYSIGHT_33500B_MODEL,
    NO_GENERATOR as NO_GENERATOR,
)
from ._keysight_33500b import (
    Keysight33500B as Keysight33500B,
)
from ._sound_card import (
    SoundCardDigitizer as SoundCardDigitizer,
    SoundCardOutput as SoundCardOutput,
)
from ._visa_link import (
    Link as Link,
    list_visa_resources as list_visa_resources,
    open_link as open_link,
)
