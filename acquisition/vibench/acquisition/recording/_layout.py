"""The names, shapes and version of the file format: the one place where the layout is spelled out.

``docs/recording-format.md`` describes the same for a stranger with h5py or MATLAB.
"""

from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

FORMAT = "vibench-recording"
FORMAT_VERSION = 1
"""Raised whenever an older reader would misunderstand the file."""

CONVENTIONS = "CF-1.11"
LIBVER = ("earliest", "v110")
"""Superblock 0: what every HDF5 reader since 1.8 understands, MATLAB's included."""

SUFFIX = ".h5"
PART_SUFFIX = ".part"
TMP_SUFFIX = ".tmp"

CHUNK_SAMPLES = 51_200
"""Samples in one compressed chunk: one second at the rig's usual rate, 200 kB."""
DEFLATE_LEVEL = 1
"""Higher levels gain 4 % of size and cost a third of the speed."""

COUNT_DTYPE = "<i4"
COUNTER_DTYPE = "<i8"
MISSING_COUNT = -(2**31)
"""Stands for a sample that was lost; CF's ``_FillValue``, so that readers show it as NaN."""
LARGEST_COUNT = 2**31 - 1

N_VALID = "n_valid"
N_ROWS = "n_rows"
STATE = "state"
REASON = "reason"
TIME = "time"
ROW = "row"
CONFIGURATION = "configuration"
RESULTS = "results"
OVERVIEW = "overview"
VIEW = "view"
SEAL = "seal"
BIN = "bin"
SETTINGS = "settings"

ROLE_WIDTH = 64
STATE_WIDTH = 16
TEXT_WIDTH = 480
"""Bytes kept of an event's text or of the reason for an end; longer ones are cut with an ellipsis."""
KIND_WIDTH = 32
NUMBERS_WIDTH = 512


class RecordingState(StrEnum):
    """How a recording ended, or that it has not."""

    RECORDING = "recording"
    COMPLETE = "complete"
    STOPPED = "stopped"
    FAILED = "failed"
    INTERRUPTED = "interrupted"


class Origin(StrEnum):
    """Whether the samples come from a real bench or from the virtual rig."""

    REAL = "real"
    SIMULATED = "simulated"


@dataclass(frozen=True)
class Column:
    """One column of a table: a one-dimensional dataset of numbers or of fixed-length text."""

    name: str
    dtype: str


@dataclass(frozen=True)
class Table:
    """A group of equally long columns; ``capacity`` rows are pre-allocated while recording."""

    name: str
    columns: tuple[Column, ...]
    capacity: int


EVENTS = Table(
    "events",
    (
        Column("sample", "<i8"),
        Column("unix_time_s", "<f8"),
        Column("kind", f"S{KIND_WIDTH}"),
        Column("text", f"S{TEXT_WIDTH}"),
    ),
    capacity=4096,
)
SEGMENTS = Table(
    "segments",
    (
        Column("first_sample", "<i8"),
        Column("last_sample", "<i8"),
        Column("is_complete", "<i4"),
        Column("label", f"S{ROLE_WIDTH}"),
        Column("numbers_json", f"S{NUMBERS_WIDTH}"),
    ),
    capacity=4096,
)
OVERLOADS = Table(
    "overloads",
    (Column("channel", f"S{ROLE_WIDTH}"), Column("first_sample", "<i8"), Column("last_sample", "<i8")),
    capacity=8192,
)
GAPS = Table("gaps", (Column("first_sample", "<i8"), Column("last_sample", "<i8")), capacity=4096)
TABLES = (EVENTS, SEGMENTS, OVERLOADS, GAPS)

OPEN_SEGMENT = -1
"""``last_sample`` of a segment that has not ended yet; never in a finished file."""

RESERVED_NAMES = frozenset(
    {
        N_VALID,
        N_ROWS,
        STATE,
        REASON,
        TIME,
        ROW,
        CONFIGURATION,
        RESULTS,
        OVERVIEW,
        VIEW,
        SEAL,
        *(table.name for table in TABLES),
    }
)


def part_of(path: Path) -> Path:
    """``NAME.h5.part``: the file while it is being recorded."""
    return path.with_name(path.name + PART_SUFFIX)


def tmp_of(path: Path) -> Path:
    """``NAME.h5.tmp``: the compressed copy while it is being made; and the ``.part`` before it is ready."""
    return path.with_name(path.name + TMP_SUFFIX)
