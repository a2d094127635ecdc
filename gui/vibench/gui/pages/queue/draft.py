"""A campaign as it is being put together: each change gives a whole, valid campaign, or is refused."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from pydantic import BaseModel

from vibench.acquisition import AcquisitionError, ConfigurationError, validated
from vibench.acquisition.campaign import ExistingRecordings, planned_recordings
from vibench.acquisition.engine import DRIVING, EngineState, RowStatus
from vibench.acquisition.plan import (
    EXCITATION_KINDS,
    Campaign,
    Measurement,
    Range,
    SweepAxis,
    duration_s,
    excitation_text,
)
from vibench.acquisition.rig import Rig

from ...widgets.notice import clock, outcome_text

USUAL_NAME = "queue"


def with_measurement(campaign: Campaign | None, measurement: Measurement) -> Campaign:
    """Add a test at the end, under a name that is free."""
    if campaign is None:
        return Campaign(name=USUAL_NAME, measurements=(measurement,))
    taken = {name.lower() for name in campaign.recording_names()}
    named = measurement.model_copy(update={"name": _free(measurement.name, taken)})
    return _changed(campaign, measurements=[*_dumped(campaign.measurements), _dump(named)])


def with_sweep(
    campaign: Campaign | None, measurement: Measurement, axis: SweepAxis, values: Range, rig: Rig | None
) -> Campaign:
    """Add a sweep of a test along an axis; raises ConfigurationError when a point of it is not allowed.

    What only a simulation foretells (loads of shaker and specimen) is checked when the campaign is armed.
    """
    taken = set() if campaign is None else {sweep.name.lower() for sweep in campaign.sweeps}
    template = _dump(measurement)
    del template["name"]
    sweep = {
        "name": _free(measurement.name, taken),
        "measurement": template,
        axis.value: values.model_dump(mode="json", exclude_none=True),
    }
    alone = validated({"name": USUAL_NAME, "sweeps": [sweep]}, Campaign, "the sweep")
    if rig is not None:
        _require_playable(alone, rig)
    if campaign is None:
        return alone
    return _changed(campaign, sweeps=[*_dumped(campaign.sweeps), sweep])


def without(campaign: Campaign, number: int) -> Campaign | None:
    """Take away one entry; None when nothing is left."""
    measurements, sweeps = _dumped(campaign.measurements), _dumped(campaign.sweeps)
    entries = [*measurements, *sweeps]
    del entries[number]
    if not entries:
        return None
    first_sweep = len(measurements) - (number < len(measurements))
    return _changed(campaign, measurements=entries[:first_sweep], sweeps=entries[first_sweep:])


def moved_up(campaign: Campaign, number: int) -> Campaign:
    """Let one entry change places with the one before it; tests stay before sweeps."""
    measurements, sweeps = _dumped(campaign.measurements), _dumped(campaign.sweeps)
    kind, place = (
        (measurements, number) if number < len(measurements) else (sweeps, number - len(measurements))
    )
    if place == 0:
        return campaign
    kind[place - 1], kind[place] = kind[place], kind[place - 1]
    return _changed(campaign, measurements=measurements, sweeps=sweeps)


def _require_playable(campaign: Campaign, rig: Rig) -> None:
    asked = max(each.excitation.highest_amplitude_vpp for _, each in campaign.recordings())
    allowed = rig.generator.amplitude_limit_vpp
    if asked > allowed:
        raise ConfigurationError(
            f"The sweep asks for up to {asked:g} Vpp; amplitude_vpp may be {allowed:g} Vpp at most on this "
            "bench (amplitude_limit_vpp of the hardware configuration): lower its levels."
        )


def _changed(campaign: Campaign, **parts: object) -> Campaign:
    return validated({**_dump(campaign), **parts}, Campaign, campaign.name)


def _dumped(models: Sequence[BaseModel]) -> list[dict[str, object]]:
    return [_dump(model) for model in models]


def _dump(model: BaseModel) -> dict[str, object]:
    content: dict[str, object] = model.model_dump(mode="json", exclude_none=True)
    return content


def _free(name: str, taken: set[str]) -> str:
    candidate, number = name, 1
    while candidate.lower() in taken:
        number += 1
        candidate = f"{name}-{number}"
    return candidate


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
