from ._app_context import (
    AppContext as AppContext,
)
from ._kind_views import (
    KIND_VIEWS as KIND_VIEWS,
    OF_A_BAND as OF_A_BAND,
    KindView as KindView,
    LivePicture as LivePicture,
)
from ._page import (
    Page as Page,
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
