"""A recording that is played back is played under the plan that it was made with."""

from pathlib import Path

from pydantic import ValidationError

from ..errors import ConfigurationError
from ..recording import open_recording
from ..rig import Rig
from ._measurement import Measurement

_PLAYED = {"excitation", "ramp_s", "ramp_step_s"}
"""What of a plan is heard in its recording."""


def require_own_plan(measurement: Measurement, rig: Rig) -> None:
    """Refuse to play a recording back under a plan that it was not made with: it would be called its result.

    Raises ConfigurationError. What was imported, or planned by another version, has no plan to compare.
    """
    path = rig.daq.options.get("recording")
    if not rig.plays_back or not isinstance(path, str):
        return
    with open_recording(Path(path)) as recording:
        try:
            made = Measurement.model_validate(dict(recording.plan))
        except ValidationError:
            return
    if made.model_dump(include=_PLAYED) != measurement.model_dump(include=_PLAYED):
        raise ConfigurationError(
            f"{path} was made with the plan of {made.name!r}, a {made.excitation.kind} whose numbers are not "
            f"those of {measurement.name!r}. Nothing was played back; give the plan that it was made with"
        )
