"""A campaign as it is being put together: each change gives a whole, valid campaign, or is refused."""

from collections.abc import Sequence

from pydantic import BaseModel

from vibench.acquisition import ConfigurationError, validated
from vibench.acquisition.plan import Campaign, Measurement, Range, SweepAxis
from vibench.acquisition.rig import Rig

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
