"""The simulated AFG1022: SCPI messages in, replies out, and the exact mean voltage at its terminal.

Commands, settings, waveform memories and status of the instrument, and a timeline of immutable signals on
its own clock, so that rendering in blocks of any size gives the same samples. Reconstructed from the IVI
driver tkafg1k and public drivers and measurements; not compared with the laboratory's own unit. Knows no
cable and no world.
"""

from ._afg1022 import (
    AFG1022,
    MAKER,
    MODEL,
    Reply,
)
from ._output_signal import (
    Panel,
)
from ._scpi_command import (
    Quirks,
)
from ._scpi_socket import (
    ScpiSocket,
)
from ._scpi_status import (
    BYTE,
    ErrorCode,
    StatusByte,
)
from ._terminal_voltage import (
    Terminal,
)

__all__ = [
    "AFG1022",
    "BYTE",
    "MAKER",
    "MODEL",
    "ErrorCode",
    "Panel",
    "Quirks",
    "Reply",
    "ScpiSocket",
    "StatusByte",
    "Terminal",
]
