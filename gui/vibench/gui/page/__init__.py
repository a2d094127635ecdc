"""What the pages of the window share.

`Page` is their base class; `Desk` hands each of them the bridge, settings, background work and
signals to the window. `Selection` holds rig, test and campaign as they are being made, none of them
sent yet; `Orders` carries out what keys, menus and buttons ask for.
Pages know each other by name only.
"""

from ._app_context import AppContext
from ._page import Page, SideAndPicture
from ._settings import (
    Remembered,
    Settings,
    default_settings_path,
)
from ._user_actions import UserActions

__all__ = [
    "AppContext",
    "Page",
    "Remembered",
    "Settings",
    "SideAndPicture",
    "UserActions",
    "default_settings_path",
]
