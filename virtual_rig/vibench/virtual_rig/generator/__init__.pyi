from ._afg1022 import (
    AFG1022 as AFG1022,
)
from ._channel_output import (
    Panel as Panel,
)
from ._keysight_33500b import (
    Keysight33500B as Keysight33500B,
)
from ._scpi_instrument import (
    Quirks as Quirks,
    Reply as Reply,
)
from ._scpi_message import (
    LONGEST_MESSAGE as LONGEST_MESSAGE,
)
from ._scpi_socket import (
    ScpiSocket as ScpiSocket,
)
from ._scpi_status import (
    BYTE as BYTE,
    ErrorCode as ErrorCode,
)
from ._terminal_voltage import (
    Terminal as Terminal,
)
