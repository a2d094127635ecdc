"""Campaigns in rows of words, and what they come to: rows, time, size."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from vibench.acquisition import AcquisitionError
from vibench.acquisition.campaign import ExistingRecordings, planned_recordings
from vibench.acquisition.engine import DRIVING, EngineState, RowStatus
from vibench.acquisition.plan import EXCITATION_KINDS, Campaign, duration_s, excitation_text
from vibench.acquisition.rig import Rig

from ...widgets.clock import clock
from ...widgets.outcome_text import outcome_text

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
    seen: "CampaignPreview | None", rows: Sequence[RowStatus], state: EngineState
) -> list[tuple[str, str, str, str]]:
    """How each recording stands: the engine's rows where it has them, else what its folder holds."""
    levels: Mapping[str, str] = {} if seen is None else seen.levels
    known = {row.name for row in rows}
    if state in DRIVING or state is EngineState.ARMED or (levels and set(levels) == known):
        return [
            (
                SYMBOLS.get(row.state, "·"),
                row.name,
                levels.get(row.name, ""),
                outcome_text(row.state, row.reason),
            )
            for row in rows
        ]
    complete = frozenset() if seen is None else seen.complete
    return [
        ("✔", name, level, "recorded before") if name in complete else ("○", name, level, "planned")
        for name, level in levels.items()
    ]


@dataclass(frozen=True)
class CampaignPreview:
    """What is shown of a campaign before it runs."""

    rows: tuple[tuple[str, str, str, str], ...]
    """As `row_words.entry_rows` gives them."""
    levels: Mapping[str, str]
    """Of each recording, its level in words."""
    complete: frozenset[str]
    """Recordings that its folder holds already."""
    duration_s: float
    size_bytes: float | None
    """None without a rig, which says how many samples a second there will be."""


def preview_campaign(asked: tuple[Campaign, Rig | None, Path]) -> CampaignPreview:
    """Look ahead, and into the folder where the recordings go."""
    campaign, rig, folder = asked
    size = None if rig is None else campaign.size_bytes(rig.daq.sample_rate_hz, len(rig.daq.channels))
    rows = tuple(entry_rows(campaign))
    levels = {
        name: f"{each.excitation.highest_amplitude_vpp:.4g} Vpp" for name, each in campaign.recordings()
    }
    try:
        planned = planned_recordings(campaign, folder, ExistingRecordings.RESUME)
        complete = frozenset(each.name for each in planned if each.is_complete)
    except AcquisitionError:  # made by another plan: arming it says so
        complete = frozenset()
    return CampaignPreview(rows, levels, complete, campaign.duration_s, size)
