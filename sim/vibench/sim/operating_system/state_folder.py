"""Where this computer keeps what a user's runs leave behind (locks, checks, costs), and what all see."""

import errno
import os
from pathlib import Path

from .this import usual_shared_folder, usual_state_folder

VARIABLE = "VIBENCH_STATE_DIR"
LOCK_VARIABLE = "VIBENCH_LOCK_DIR"


def state_place() -> Path:
    """Return where the user's own folder is, or would be; ``VIBENCH_STATE_DIR`` names another place."""
    given = os.environ.get(VARIABLE)
    return Path(given) if given else usual_state_folder()


def state_folder() -> Path:
    """Return the user's own folder, made if need be; raises PermissionError where none can be made."""
    folder = state_place()
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    except OSError as error:  # a file in the way, a disk that makes no folders
        refused = PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(folder))
        refused.add_note(f"{VARIABLE} names another folder for locks, bench checks and learnt costs")
        raise refused from error
    return folder


def shared_folder() -> Path:
    """Return the folder where every user may make files; ``VIBENCH_LOCK_DIR`` names another."""
    return Path(os.environ.get(LOCK_VARIABLE) or usual_shared_folder())
