"""Whether the specimen is what it was: innovations of a track against a baseline, block by block.

Each block of a tenth of a second lies within the level that is usual, or out. Page's test (CUSUM, Biometrika
41, 100, 1954) adds up the likelihood ratio of "one block in two is out" to "one in a hundred is". By Lorden
(Ann. Math. Stat. 42, 1897, 1971) the mean time between false alarms is at least exp(threshold) blocks, as
long as no more than one block in a hundred lies out without a change; the threshold is chosen so that this is
`FALSE_ALARM_S`. Five blocks in a row that lie out are an alarm.
"""

import hashlib
import math
from collections.abc import Mapping
from datetime import datetime
from pathlib import Path

import numpy as np
from pydantic import ValidationError

from vibench.acquisition.rig import Rig
from vibench.sim import FrozenModel, Specimen
from vibench.sim.operating_system.state_folder import state_folder
from vibench.sim.operating_system.this import replaced

from ._parameters import Hidden

BLOCK_S = 0.1
FALSE_ALARM_S = 1000 * 3600.0
"""Mean time between false alarms, at least [s]."""
OUT_BY_CHANCE = 0.01
"""Largest share of blocks that lie out while nothing has changed."""
_OUT_WHEN_CHANGED = 0.5
_OUT_ADDS = math.log(_OUT_WHEN_CHANGED / OUT_BY_CHANCE)
_IN_ADDS = math.log((1.0 - _OUT_WHEN_CHANGED) / (1.0 - OUT_BY_CHANCE))
THRESHOLD = math.log(FALSE_ALARM_S / BLOCK_S)
_CALIBRATING = 20
"""Blocks of a motion whose usual level is not kept yet."""
_LARGER, _SCATTERS = 1.5, 8.0
"""A block is out if it exceeds this multiple of the usual level, and this number of deviations above it."""
_FOLDER = "hidden_motion"
_HASH_DIGITS = 16


class Level(FrozenModel):
    """Mean squared normalised innovation of blocks of flight, its outliers clipped."""

    mean: float
    sd: float
    """From block to block."""

    @property
    def limit(self) -> float:
        """Above it a block lies out."""
        return max(_LARGER * self.mean, self.mean + _SCATTERS * self.sd)


class KnownNumber(FrozenModel):
    """A number of the specimen, and its bounds of 95 %."""

    value: float
    low: float
    high: float


class Baseline(FrozenModel):
    """A specimen on its bench while it was in order."""

    bench: str
    since: datetime
    numbers: Mapping[Hidden, KnownNumber]
    """Those that its collisions told."""
    levels: Mapping[str, Level]
    """By what was played."""


def baseline_path(rig: Rig, specimen: Specimen) -> Path:
    """Name the file of the baseline of a specimen, as described, on a bench; in the user's state folder."""
    digest = hashlib.sha256(f"{rig.name}\n{specimen!r}".encode()).hexdigest()[:_HASH_DIGITS]
    return state_folder() / _FOLDER / f"{digest}.json"


def kept_baseline(path: Path) -> Baseline | None:
    """Read a baseline; None when there is none, or none that this version can read."""
    try:
        return Baseline.model_validate_json(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, ValidationError):
        return None


def keep_baseline(baseline: Baseline, path: Path) -> None:
    """Keep a baseline in the place of the last one; raises OSError when the folder cannot be written."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with replaced(path) as coming:
        coming.write_text(baseline.model_dump_json(indent=2), encoding="utf-8")


class ChangeWatch:
    """Takes the level of one block after the other, and says when they are no longer the usual ones."""

    def __init__(self, usual: Level | None = None) -> None:
        """``usual`` as kept; learnt from the first two seconds when there is none."""
        self.usual = usual
        self._learnt: list[float] = []
        self._sum = 0.0
        self.has_changed = False

    def take(self, level: float) -> bool:
        """Take a block, infinite where the motion could not be followed; whether that is the alarm."""
        if self.usual is None:
            if math.isfinite(level):
                self._learnt.append(level)
            if len(self._learnt) == _CALIBRATING:
                self.usual = Level(mean=float(np.mean(self._learnt)), sd=float(np.std(self._learnt, ddof=1)))
            return False
        added = _OUT_ADDS if level > self.usual.limit else _IN_ADDS
        self._sum = max(0.0, self._sum + added)
        is_alarm = self._sum >= THRESHOLD and not self.has_changed
        self.has_changed = self.has_changed or is_alarm
        return is_alarm
