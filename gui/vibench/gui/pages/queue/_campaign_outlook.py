"""What a campaign comes to: rows, time, size; worked out elsewhere, for it may have thousands of points."""

from dataclasses import dataclass

from vibench.acquisition.plan import Campaign
from vibench.acquisition.rig import Rig

from ._row_words import entry_rows


@dataclass(frozen=True)
class CampaignOutlook:
    """What is shown of a campaign before it runs."""

    rows: tuple[tuple[str, str, str, str], ...]
    """As `row_words.entry_rows` gives them."""
    names: tuple[str, ...]
    """Of its recordings."""
    duration_s: float
    size_bytes: float | None
    """None without a rig, which says how many samples a second there will be."""


def campaign_outlook(asked: tuple[Campaign, Rig | None]) -> CampaignOutlook:
    """Look ahead."""
    campaign, rig = asked
    size = None if rig is None else campaign.size_bytes(rig.daq.sample_rate_hz, len(rig.daq.channels))
    rows = tuple(entry_rows(campaign))
    return CampaignOutlook(rows, tuple(campaign.recording_names()), campaign.duration_s, size)
