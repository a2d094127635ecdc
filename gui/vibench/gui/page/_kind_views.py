"""Which live pictures suit each kind of excitation."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum, auto
from types import MappingProxyType

from vibench.acquisition.plan import EXCITATION_KINDS, Family


class LivePicture(Enum):
    """A picture of the Run page that grows while it is recorded."""

    FREQUENCY_RESPONSE = auto()
    HISTORY = auto()
    """Responses against the frequency really played."""
    ENVELOPE = auto()
    SPECTRUM = auto()
    PORTRAIT = auto()


@dataclass(frozen=True)
class KindView:
    """What is in front when a run of a kind begins."""

    left: LivePicture
    right: LivePicture


OF_A_BAND = KindView(LivePicture.FREQUENCY_RESPONSE, LivePicture.SPECTRUM)
OF_A_SINE = KindView(LivePicture.HISTORY, LivePicture.PORTRAIT)
_FAMILY_VIEWS = {
    Family.NOISE: OF_A_BAND,
    Family.SWEEP: OF_A_SINE,
    Family.DWELL: OF_A_SINE,
    Family.STEPPED: OF_A_SINE,
}
KIND_VIEWS: Mapping[str, KindView] = MappingProxyType(
    {word: _FAMILY_VIEWS[kind.plan.family] for word, kind in EXCITATION_KINDS.items()}
)
"""Kinds of a family share their pictures; a kind with its own overrides them here."""
