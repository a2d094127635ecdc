from ._app_context import (
    AppContext as AppContext,
)
from ._file_kind import (
    FileKind as FileKind,
    file_kind as file_kind,
)
from ._history import (
    History as History,
)
from ._kind_views import (
    KIND_VIEWS as KIND_VIEWS,
    OF_A_BAND as OF_A_BAND,
    KindView as KindView,
    LivePicture as LivePicture,
)
from ._page import (
    Page as Page,
    Shown as Shown,
    SideAndPicture as SideAndPicture,
)
from ._settings import (
    Remembered as Remembered,
    Settings as Settings,
    default_settings_path as default_settings_path,
)
from ._simulator import (
    Simulator as Simulator,
)
from ._user_actions import (
    UserActions as UserActions,
)
