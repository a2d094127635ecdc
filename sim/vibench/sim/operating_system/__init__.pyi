from ._open_file import (
    Buffer as Buffer,
    OpenFile as OpenFile,
    sync_file as sync_file,
)
from ._processes import (
    Place as Place,
    is_process as is_process,
    place_of as place_of,
)
from ._state_folder import (
    LOCK_VARIABLE as LOCK_VARIABLE,
    VARIABLE as VARIABLE,
    shared_folder as shared_folder,
    state_folder as state_folder,
    state_place as state_place,
)
from ._this import (
    allocate as allocate,
    bound_memory as bound_memory,
    is_locked_alone as is_locked_alone,
    lower_priority as lower_priority,
    open_for_all as open_for_all,
    open_to_write as open_to_write,
    process_start as process_start,
    read_at as read_at,
    sync_folder as sync_folder,
    write_at as write_at,
)
