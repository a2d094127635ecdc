"""The last check of each rig, kept in the user's state folder: one JSON file a rig."""

import hashlib
import os
import re
import tempfile
from pathlib import Path

from pydantic import ValidationError

from ..bench import CheckResult
from ..errors import RecordingError
from ..host import state_folder

FOLDER = "bench_checks"
_HASH_DIGITS = 8


def archive_path(rig_name: str) -> Path:
    """Name the file of a rig: its name as far as files allow it, and a hash of the whole of it."""
    plain = re.sub(r"[^A-Za-z0-9]+", "_", rig_name).strip("_")[:48]
    digest = hashlib.sha256(rig_name.encode()).hexdigest()[:_HASH_DIGITS]
    return state_folder() / FOLDER / f"{plain}-{digest}.json"


def last_result(rig_name: str) -> CheckResult | None:
    """Give the last check of a rig; None when there is none, or none that this version can read."""
    try:
        return CheckResult.model_validate_json(archive_path(rig_name).read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, ValidationError):
        return None


def keep(result: CheckResult) -> Path:
    """Keep a result in the place of the last one; whoever reads meanwhile finds one of the two, whole.

    Raises
    ------
    RecordingError
        When the state folder cannot be written.

    """
    try:
        path = archive_path(result.rig)
        path.parent.mkdir(parents=True, exist_ok=True)
        descriptor, name = tempfile.mkstemp(prefix=path.name, suffix=".tmp", dir=path.parent)
        with os.fdopen(descriptor, "w", encoding="utf-8") as file:
            file.write(result.model_dump_json(indent=2))
        Path(name).replace(path)
    except OSError as error:
        raise RecordingError(
            f"The result of the bench check cannot be kept in {error.filename} ({error.strerror}). The bench "
            "is as it was; make its folder writable, or name another one in VIBENCH_STATE_DIR"
        ) from error
    return path
