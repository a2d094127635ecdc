"""Campaigns in rows of words, and what they come to: rows, time, size."""

from collections.abc import Sequence
from dataclasses import dataclass

from vibench.acquisition.engine import DRIVING, EngineState, RowStatus
from vibench.acquisition.plan import EXCITATION_KINDS, Campaign, duration_s, excitation_text
from vibench.acquisition.rig import Rig

from ...widgets import clock

SYMBOLS = {
    "queued": "○",
    "running": "▶",
    "recorded": "✔",
    "kept": "✔",
    "stopped": "■",
    "failed": "✖",
}


def entry_rows(campaign: Campaign) -> list[tuple[str, str, str, str]]:
    """One row a test and a sweep: name, what, how many recordings, how long."""
    rows = [
        (
            each.name,
            excitation_text(each.excitation),
            str(each.repeats),
            clock(each.repeats * duration_s(each)),
        )
        for each in campaign.measurements
    ]
    for sweep in campaign.sweeps:
        points = sweep.points()
        kinds = dict.fromkeys(point.measurement.excitation.kind for point in points)
        kind = ", ".join(EXCITATION_KINDS[each].label for each in kinds)
        takes = sum(duration_s(point.measurement) for point in points)
        rows.append((sweep.name, f"sweep of {kind}", str(len(points)), clock(takes)))
    return rows


def point_rows(
    campaign: Campaign | None, rows: Sequence[RowStatus], state: EngineState
) -> list[tuple[str, str, str]]:
    """How each recording stands: the engine's rows where it has them, else what is planned."""
    names = () if campaign is None else campaign.recording_names()
    known = {row.name: row for row in rows}
    if state in DRIVING or state is EngineState.ARMED or (names and set(names) == set(known)):
        return [(SYMBOLS.get(row.state, "·"), row.name, f"{row.state}  {row.reason}".strip()) for row in rows]
    return [("○", name, "planned") for name in names]


@dataclass(frozen=True)
class CampaignPreview:
    """What is shown of a campaign before it runs."""

    rows: tuple[tuple[str, str, str, str], ...]
    """As `row_words.entry_rows` gives them."""
    names: tuple[str, ...]
    """Of its recordings."""
    duration_s: float
    size_bytes: float | None
    """None without a rig, which says how many samples a second there will be."""


def preview_campaign(asked: tuple[Campaign, Rig | None]) -> CampaignPreview:
    """Look ahead."""
    campaign, rig = asked
    size = None if rig is None else campaign.size_bytes(rig.daq.sample_rate_hz, len(rig.daq.channels))
    rows = tuple(entry_rows(campaign))
    return CampaignPreview(rows, tuple(campaign.recording_names()), campaign.duration_s, size)
