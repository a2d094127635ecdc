from ._bus import (
    plug_in as plug_in,
    plug_in_remote as plug_in_remote,
    unplug as unplug,
)
from ._remote import (
    usb_service as usb_service,
)
from ._usbtmc import (
    UsbTmcInstrument as UsbTmcInstrument,
)
