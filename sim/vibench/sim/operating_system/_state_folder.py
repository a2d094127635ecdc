"""Where this computer keeps what a user's runs leave behind (locks, checks, costs), and what all see."""

import os
from pathlib import Path

from ._this import usual_shared_folder, usual_state_folder

VARIABLE = "VIBENCH_STATE_DIR"
LOCK_VARIABLE = "VIBENCH_LOCK_DIR"


def state_folder() -> Path:
    """Give the user's own folder, made if need be; ``VIBENCH_STATE_DIR`` names another one."""
    given = os.environ.get(VARIABLE)
    folder = Path(given) if given else usual_state_folder()
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    return folder


def shared_folder() -> Path:
    """Give the folder where every user may make files; ``VIBENCH_LOCK_DIR`` names another."""
    return Path(os.environ.get(LOCK_VARIABLE) or usual_shared_folder())
