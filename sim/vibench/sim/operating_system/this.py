"""The functions of the system that runs this program."""

import sys

if sys.platform == "win32":
    from .windows import (
        allocate,
        bound_memory,
        is_locked_alone,
        lock_in_use,
        lock_sole_writer,
        lower_priority,
        open_for_all,
        open_to_write,
        process_start,
        read_at,
        sync_data,
        sync_folder,
        usual_shared_folder,
        usual_state_folder,
        write_at,
    )
else:
    from .posix import (
        allocate,
        bound_memory,
        is_locked_alone,
        lock_in_use,
        lock_sole_writer,
        lower_priority,
        open_for_all,
        open_to_write,
        process_start,
        read_at,
        sync_data,
        sync_folder,
        usual_shared_folder,
        usual_state_folder,
        write_at,
    )

__all__ = [
    "allocate",
    "bound_memory",
    "is_locked_alone",
    "lock_in_use",
    "lock_sole_writer",
    "lower_priority",
    "open_for_all",
    "open_to_write",
    "process_start",
    "read_at",
    "sync_data",
    "sync_folder",
    "usual_shared_folder",
    "usual_state_folder",
    "write_at",
]
