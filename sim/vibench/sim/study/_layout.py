"""Names, types and version of a study's file: the one place where the layout is spelled out.

``docs/studies.md`` says the same for a stranger with h5py, xarray or MATLAB.
"""

from dataclasses import dataclass
from enum import IntEnum

FORMAT = "vibench-study"
FORMAT_VERSION = 2
"""Raised whenever an older reader would misunderstand the file."""
CONVENTIONS = "CF-1.11"
LIBVER = ("earliest", "v110")
"""Superblock 0: what every HDF5 reader since 1.8 understands, MATLAB's included."""

STUDY = "study_json"
STATE = "state"
SESSIONS = "sessions"
N_SESSIONS = "n_sessions"
STATE_DTYPE = "u1"
COUNTER_DTYPE = "<i8"


class PointState(IntEnum):
    """What is known of a point; the last thing that is written of it."""

    MISSING = 0
    """Not computed yet."""
    DONE = 1
    """The run reached its end."""
    STOPPED = 2
    """The run did not reach its end; ``outcome`` says why. Its numbers may be NaN."""
    FAILED = 3
    """The scene could not be computed; ``message`` says why. Its numbers are NaN."""
    FILLED = 4
    """Of a map: not computed, because its neighbours agree; its numbers lie between theirs."""


@dataclass(frozen=True)
class TextColumn:
    """One column of the table of sessions: text of fixed length."""

    name: str
    width: int


SESSION_COLUMNS = (
    TextColumn("started_utc", 32),
    TextColumn("software_json", 512),
    TextColumn("executor", 160),
)
"""A session is one go at a study: the first, and every resumption."""
MOST_SESSIONS = 1024
"""What is resumed more often notes its further sessions in the last row."""
