from ._afg1022x import (
    AFG1022X as AFG1022X,
)
from ._daqmx import (
    DaqmxDigitizer as DaqmxDigitizer,
)
from ._daqmx_discovery import (
    list_daqmx_devices as list_daqmx_devices,
)
from ._daqmx_output import (
    DaqmxOutput as DaqmxOutput,
)
from ._visa_link import (
    list_visa_resources as list_visa_resources,
)
