"""What a campaign will take, before it begins: recordings, time on the rig, room on the disk."""

import shutil
from dataclasses import dataclass
from pathlib import Path

from ..control.fast_loop import require_holdable
from ..excitation.plan import AbstractFeedback
from ..plan import BYTES_PER_SAMPLE, Campaign, measured_s, require_played
from ..rig import Rig, channels_of
from ._opening import planned_recordings
from ._point_outcome import ExistingRecordings

WRITTEN_SHARE = 1 / 1.7
"""A finished recording over its size while it is made: white noise at 24 bit; dwells need less."""


@dataclass(frozen=True)
class CampaignEstimate:
    """How long and how large a campaign is; what is there already is not counted."""

    recordings: int
    """Still to be made."""
    kept: int
    """Complete already."""
    duration_s: float
    """On the rig, with bench checks, lead-ins and ramps."""
    rest_s: float
    """Of that, silence between recordings."""
    lead_in_s: float
    """Of that, on the way to points along their chains."""
    largest_bytes: int
    """Of one recording, while it is made."""
    total_bytes: int
    """Of all recordings, finished."""
    free_bytes: int
    """On the disk of the folder, now."""
    searching: int = 0
    """How many of the recordings end sooner where their feedback needs less than its longest searches."""

    @property
    def needed_bytes(self) -> int:
        """Room that must be there for the campaign to come to its end."""
        return self.total_bytes + self.largest_bytes

    @property
    def fits(self) -> bool:
        """Whether the disk has that room."""
        return self.needed_bytes <= self.free_bytes


def estimate_campaign(
    campaign: Campaign, rig: Rig, folder: Path, existing: ExistingRecordings = ExistingRecordings.REFUSE
) -> CampaignEstimate:
    """Say what a campaign will take on a rig; opens no instrument and writes nothing.

    Raises
    ------
    RecordingError
        When the folder holds recordings of the campaign and ``existing`` refuses that.
    ConfigurationError
        When the rig lacks what a measurement is played with.
    LimitExceeded
        When its fast loop does not hold the motions that one asks for.

    """
    for each in campaign.measurements:
        require_played(each, rig)
    planned = planned_recordings(campaign, folder, existing)
    missing = [each.measurement for each in planned if not each.is_complete]
    for each in missing:
        require_holdable(each, rig)
    durations_s = [measured_s(each) for each in missing]
    bytes_per_s = rig.daq.sample_rate_hz * len(channels_of(rig)) * BYTES_PER_SAMPLE
    rest_s = campaign.rest_s * max(0, len(missing) - 1)
    return CampaignEstimate(
        recordings=len(missing),
        kept=len(planned) - len(missing),
        duration_s=sum(durations_s) + rest_s,
        rest_s=rest_s,
        lead_in_s=sum(each.excitation.lead_in_s for each in missing),
        largest_bytes=round(max(durations_s, default=0.0) * bytes_per_s),
        total_bytes=round(sum(durations_s) * bytes_per_s * WRITTEN_SHARE),
        free_bytes=shutil.disk_usage(_existing_part(folder)).free,
        searching=sum(isinstance(each.excitation, AbstractFeedback) for each in missing),
    )


def _existing_part(folder: Path) -> Path:
    """Give the folder, or the nearest one above it that exists already."""
    return next(each for each in (folder.resolve(), *folder.resolve().parents) if each.exists())
