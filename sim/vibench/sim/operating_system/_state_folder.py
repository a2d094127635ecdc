"""Where this computer keeps what a user's runs leave behind: locks, checks, costs."""

import os
from pathlib import Path

from ._this import usual_state_folder

VARIABLE = "VIBENCH_STATE_DIR"


def state_folder() -> Path:
    """Give the user's own folder, made if need be; ``VIBENCH_STATE_DIR`` names another one."""
    given = os.environ.get(VARIABLE)
    folder = Path(given) if given else usual_state_folder()
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    return folder
