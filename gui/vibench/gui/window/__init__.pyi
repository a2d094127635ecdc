from ._banner import (
    CLOSED as CLOSED,
    StateIndicator as StateIndicator,
)
from ._display import (
    display_trouble as display_trouble,
)
from ._open_window import (
    open_window as open_window,
)
from ._screenshots import (
    make_screenshots as make_screenshots,
)
from ._status_line import (
    StatusField as StatusField,
)
