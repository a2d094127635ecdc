"""The columns of a map's file: fewer than a study's, because a map has many points and no errors of each."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..model.specimen import Specimen
from ..scene.prediction import MotionKind, ScenePrediction
from ..study import COLUMNS, MESSAGE, Cell, Column

KEPT = (
    "response_i",
    "response_ii",
    "relative_i",
    "relative_ii",
    "impact_rate",
    "period",
    "duration",
    "lyapunov",
    "lyapunov_error",
    "motion",
    "outcome",
    "final_state",
    "drive_phase",
    "continues",
    "taken",
    "session",
    "state",
)
"""Of a study."""
MESSAGE_BYTES = 100
ENERGY = Column("contact_energy", "<f8", "J", "largest energy that a stop has stored")
SECTION_STATES = 64
"""States once a drive period that are kept of a motion along one quantity, at most."""
SECTION_COLUMNS = tuple(
    Column(f"section_{name}", "<f8", "m", f"{what} once a drive period", (), SECTION_STATES, "drive_period")
    for name, what in (("x", "displacement of m0"), ("p", "displacement of m1 against m2"))
)
"""Of a map along one quantity."""
_OF_STUDIES = {column.name: column for column in COLUMNS}
_MAP_COLUMNS = (
    *(_OF_STUDIES[name] for name in KEPT[:-1]),
    ENERGY,
    replace(_OF_STUDIES[MESSAGE], dtype=f"S{MESSAGE_BYTES}"),
)


def columns_with(more: Sequence[Column]) -> tuple[Column, ...]:
    """Give all columns; the state of a point is the last."""
    return (*_MAP_COLUMNS, *more, _OF_STUDIES["state"])


LONGER = 64
"""Than the longest period that is looked for."""


_PERIODIC = list(MotionKind).index(MotionKind.PERIODIC)


def without_impacts(arrays: Mapping[str, NDArray[Any]]) -> NDArray[np.bool_]:
    """Say which points came to the motion that nothing but the drive tells from rest."""
    is_first = (arrays["motion"] == _PERIODIC) & (arrays["period"] == 1)
    return np.asarray(is_first & (arrays["impact_rate"] == 0.0))


def labels_of(arrays: Mapping[str, NDArray[Any]]) -> NDArray[np.int64]:
    """Give the same number to motions of one kind and period; a motion without impacts has its own."""
    motion, period = (arrays[name].astype(np.int64) for name in ("motion", "period"))
    return np.where(without_impacts(arrays), _PERIODIC * LONGER, motion * LONGER + period)


def contact_energy_j(specimen: Specimen, found: ScenePrediction) -> float | None:
    """Find the most energy that a stop stored [J], from the largest penetration; None where none yields.

    Where gaps differ, the largest abs(p) does not tell which stop was reached: None beyond the nearer.
    """
    stops = specimen.contact.stops
    if found.relative_i is None or stops.restitution is not None:
        return None
    if stops.linear_stiffness == stops.contact_stiffness == 0.0:
        return None
    depth = max(0.0, found.relative_i * found.amplitude_m - min(specimen.gaps_m))
    if depth > 0.0 and len(set(specimen.gaps_m)) > 1:
        return None
    return float(0.5 * stops.linear_stiffness * depth**2 + 0.4 * stops.contact_stiffness * depth**2.5)


def section_cells(found: ScenePrediction) -> dict[str, Cell]:
    """Take the last states once a drive period: as many as a motion has that repeats, else as are kept."""
    if found.section is None:
        return {}
    most = min(SECTION_STATES, found.period or SECTION_STATES)
    states = found.section[-most:]
    rows = {"section_x": states[:, 0], "section_p": states[:, 1] - states[:, 2]}
    nothing = (float("nan"),) * (SECTION_STATES - len(states))
    return {name: (*(float(each) for each in row), *nothing) for name, row in rows.items()}
