"""Edits of a campaign; an edit that would make the campaign invalid is refused."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from pydantic import BaseModel

from vibench.acquisition import AcquisitionError, ConfigurationError, validate
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
    """Return the campaign with a test added at the end, under an unused name."""
    if campaign is None:
        return Campaign(name=USUAL_NAME, measurements=(measurement,))
    taken = {name.lower() for name in campaign.recording_names()}
    named = measurement.model_copy(update={"name": _free(measurement.name, taken)})
    return _update(campaign, measurements=[*_dump_all(campaign.measurements), _dump(named)])


def with_sweep(
    campaign: Campaign | None, measurement: Measurement, axis: SweepAxis, values: Range, rig: Rig | None
) -> Campaign:
    """Return the campaign with a sweep added, which repeats a test along an axis.

    Raises ConfigurationError when a point of the sweep is not allowed. Limits that need a simulation (loads
    of shaker and specimen) are checked later, when the campaign is armed.
    """
    taken = set() if campaign is None else {sweep.name.lower() for sweep in campaign.sweeps}
    template = _dump(measurement)
    del template["name"]
    sweep = {
        "name": _free(measurement.name, taken),
        "measurement": template,
        axis.value: values.model_dump(mode="json", exclude_none=True),
    }
    alone = validate({"name": USUAL_NAME, "sweeps": [sweep]}, Campaign, "the sweep")
    if rig is not None:
        needed_v = max(each.excitation.highest_amplitude_vpp for _, each in alone.recordings())
        allowed = rig.generator.amplitude_limit_vpp
        if needed_v > allowed:
            raise ConfigurationError(
                f"The sweep needs up to {needed_v:g} Vpp; amplitude_vpp may be {allowed:g} Vpp at most on "
                "this bench (amplitude_limit_vpp of the hardware configuration). Lower the sweep's levels."
            )
    if campaign is None:
        return alone
    return _update(campaign, sweeps=[*_dump_all(campaign.sweeps), sweep])


def remove_entry(campaign: Campaign, number: int) -> Campaign | None:
    """Return the campaign without one test or sweep; None if no other entry is left."""
    measurements, sweeps = _dump_all(campaign.measurements), _dump_all(campaign.sweeps)
    entries = [*measurements, *sweeps]
    del entries[number]
    if not entries:
        return None
    first_sweep = len(measurements) - (number < len(measurements))
    return _update(campaign, measurements=entries[:first_sweep], sweeps=entries[first_sweep:])


def move_up(campaign: Campaign, number: int) -> Campaign:
    """Return the campaign with one test or sweep moved up by one row; tests stay before sweeps."""
    measurements, sweeps = _dump_all(campaign.measurements), _dump_all(campaign.sweeps)
    kind, place = (
        (measurements, number) if number < len(measurements) else (sweeps, number - len(measurements))
    )
    if place == 0:
        return campaign
    kind[place - 1], kind[place] = kind[place], kind[place - 1]
    return _update(campaign, measurements=measurements, sweeps=sweeps)


def _update(campaign: Campaign, **parts: object) -> Campaign:
    return validate({**_dump(campaign), **parts}, Campaign, campaign.name)


def _dump_all(models: Sequence[BaseModel]) -> list[dict[str, object]]:
    return [_dump(model) for model in models]


def _dump(model: BaseModel) -> dict[str, object]:
    return model.model_dump(mode="json", exclude_none=True)


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
    """Return a row per test and sweep: name, excitation, number of recordings, duration."""
    places = campaign.places
    rows = [
        (
            each.name,
            excitation_text(each.excitation),
            str(places * each.repeats),
            clock(places * each.repeats * duration_s(each)),
        )
        for each in campaign.measurements
    ]
    for sweep in campaign.sweeps:
        points = sweep.points()
        kinds = dict.fromkeys(point.measurement.excitation.kind for point in points)
        kind = ", ".join(EXCITATION_KINDS[each].label for each in kinds)
        takes = sum(duration_s(point.measurement) for point in points)
        rows.append((sweep.name, f"sweep of {kind}", str(places * len(points)), clock(places * takes)))
    return rows


def point_rows(
    preview: "CampaignPreview | None", rows: Sequence[RowStatus], state: EngineState
) -> list[tuple[str, str, str, str]]:
    """Return a row per recording with its state, as reported by the engine or found in the folder."""
    levels: Mapping[str, str] = {} if preview is None else preview.levels
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
    complete = frozenset() if preview is None else preview.complete
    return [
        ("✔", name, level, "recorded before") if name in complete else ("○", name, level, "planned")
        for name, level in levels.items()
    ]


@dataclass(frozen=True)
class CampaignPreview:
    """Summary of a campaign: entries, drive levels, existing recordings, duration, and file size."""

    rows: tuple[tuple[str, str, str, str], ...]
    levels: Mapping[str, str]
    """Drive level of each recording, as text."""
    complete: frozenset[str]
    """Names of the recordings that are already complete in the folder."""
    duration_s: float
    size_bytes: float | None
    """Size of the files [bytes]; None without a rig, because the rig defines the sample rate."""


def preview_campaign(request: tuple[Campaign, Rig | None, Path]) -> CampaignPreview:
    """Return a campaign's entries, drive levels, duration and size, and the recordings in its folder."""
    campaign, rig, folder = request
    size = None if rig is None else campaign.size_bytes(rig.daq.sample_rate_hz, len(rig.daq.channels))
    rows = tuple(entry_rows(campaign))
    levels = {
        name: f"{each.excitation.highest_amplitude_vpp:.4g} Vpp" for name, each in campaign.recordings()
    }
    try:
        planned = planned_recordings(campaign, folder, ExistingRecordings.RESUME)
        complete = frozenset(each.name for each in planned if each.is_complete)
    except AcquisitionError:  # the recordings belong to another plan, as arming will report
        complete = frozenset()
    return CampaignPreview(rows, levels, complete, campaign.duration_s, size)
