"""Where this computer keeps what a user's runs leave behind: locks, checks, costs."""

import os
import sys
from pathlib import Path

VARIABLE = "VIBENCH_STATE_DIR"


def state_folder() -> Path:
    """Give the user's own folder, made if need be; ``VIBENCH_STATE_DIR`` names another one."""
    folder = _named() or _usual()
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    return folder


def _named() -> Path | None:
    given = os.environ.get(VARIABLE)
    return Path(given) if given else None


def _usual() -> Path:
    home = Path.home()
    match sys.platform:
        case "win32":
            return Path(os.environ.get("LOCALAPPDATA", home / "AppData" / "Local")) / "vibench"
        case "darwin":
            return home / "Library" / "Application Support" / "vibench"
        case _:
            return Path(os.environ.get("XDG_STATE_HOME", home / ".local" / "state")) / "vibench"
