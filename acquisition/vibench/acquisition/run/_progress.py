"""What a run tells whoever watches it: where it stands, and how it ended."""

from dataclasses import dataclass
from pathlib import Path

from ..excitation import Segment
from ..instruments import Block
from ..plan import RunState
from ..stopping import Cause


@dataclass(frozen=True, eq=False)
class Progress:
    """Where a run stands after each block, for whoever watches."""

    state: RunState
    segment: Segment | None
    """The named range of the recording that the block belongs to."""
    block: Block
    elapsed_s: float
    """Recorded so far [s]."""
    total_s: float
    """Planned, from the first sample to the last [s]."""
    amplitude_vpp: float
    """Setting of the generator, peak to peak [V]; 0 while its output is off."""
    frequency_hz: float | None = None
    """Of the sine that is played; None for anything else."""


@dataclass(frozen=True)
class Outcome:
    """How a run ended."""

    state: RunState
    reason: str
    path: Path
    """The recording."""
    cause: Cause | None = None
    """What ended it before its plan did; None for a plan carried out."""
