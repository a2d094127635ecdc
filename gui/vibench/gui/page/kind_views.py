"""Live pictures for each kind of excitation."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum, auto

from vibench.acquisition.plan import Family, rows_by_kind


class LivePicture(Enum):
    """A picture of the Run page that is updated during a run."""

    FREQUENCY_RESPONSE = auto()
    HISTORY = auto()
    """Responses against the actual drive frequency."""
    ENVELOPE = auto()
    SPECTRUM = auto()
    PORTRAIT = auto()


@dataclass(frozen=True)
class KindView:
    """The two pictures shown when a run of a kind starts."""

    left: LivePicture
    right: LivePicture


OF_A_BAND = KindView(LivePicture.FREQUENCY_RESPONSE, LivePicture.SPECTRUM)
OF_A_SINE = KindView(LivePicture.HISTORY, LivePicture.PORTRAIT)
KIND_VIEWS: Mapping[str, KindView] = rows_by_kind(
    {
        Family.NOISE: OF_A_BAND,
        Family.SWEEP: OF_A_SINE,
        Family.DWELL: OF_A_SINE,
        Family.STEPPED: OF_A_SINE,
    },
    {},
)
"""Live pictures by kind of excitation; the second table is for kinds that differ from their family."""
