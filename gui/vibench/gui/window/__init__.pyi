from ._banner import (
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
