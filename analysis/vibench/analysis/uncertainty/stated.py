"""What a hardware configuration states of its sensors, its converter and its clock."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from .budget import Cause, Contribution

_SENSORS = {"vibrometer": Cause.VIBROMETER, "accelerometer": Cause.ACCELEROMETER}
_ROLES = {"vibrometer": "m0_velocity", "accelerometer": "base_acceleration"}


@dataclass(frozen=True)
class Stated:
    """Relative standard uncertainties of what the channels show, by what a bench configuration says."""

    response: tuple[Contribution, ...]
    """Of the vibrometer's channel."""
    base: tuple[Contribution, ...]
    """Of the accelerometer's channel."""
    clock: Contribution
    """Of every frequency."""

    @property
    def scale_sd(self) -> float:
        """Relative standard deviation of response over base, as far as stated; 0 where nothing is."""
        stated = [each.relative for each in (*self.response, *self.base) if each.relative is not None]
        return float(np.sqrt(np.sum(np.square(stated))))

    def timed(self, power: int) -> tuple[Contribution, ...]:
        """Give the clock's part in what follows a frequency to a power."""
        relative = None if self.clock.relative is None else abs(power) * self.clock.relative
        return (Contribution(Cause.CLOCK, relative, self.clock.source),)


def stated_of(bench: Mapping[str, Any]) -> Stated:
    """Read what the bench configuration in a recording states.

    A calibration is normal with its coverage factor. An alignment within an angle scales by its cosine: the
    root of the uncorrected mean square is taken (JCGM 100:2008, F.2.4.5), the angle being uniform. A clock
    within bounds is uniform.
    """
    return Stated(
        tuple(_channel(bench, "vibrometer")), tuple(_channel(bench, "accelerometer")), _clock(bench)
    )


def _channel(bench: Mapping[str, Any], sensor: str) -> Iterator[Contribution]:
    said = bench.get(sensor) or {}
    yield _calibration(_SENSORS[sensor], said, sensor)
    inputs = (bench.get("daq") or {}).get("channels") or ()
    mine: Mapping[str, Any] = next((each for each in inputs if each.get("role") == _ROLES[sensor]), {})
    yield _calibration(Cause.CONVERTER, mine, f"input of {_ROLES[sensor]}")
    angle = said.get("alignment_deg")
    if angle is None:
        yield Contribution(Cause.ALIGNMENT, None, f"{sensor}: alignment_deg is not stated")
    else:
        # Of (angle^2 / 2)^2 over a uniform angle.
        relative = np.radians(float(angle["value"])) ** 2 / np.sqrt(20.0)
        yield Contribution(Cause.ALIGNMENT, float(relative), f"{sensor}: {angle['source']}")


def _calibration(cause: Cause, said: Mapping[str, Any], what: str) -> Contribution:
    found, dated = said.get("uncertainty"), said.get("calibrated")
    when = f"calibrated {dated}" if dated else "no date of calibration"
    if found is None:
        return Contribution(cause, None, f"{what}: uncertainty is not stated ({when})")
    relative = float(found["relative"]) / float(found.get("coverage_factor", 2.0))
    return Contribution(cause, relative, f"{what}: {found['source']} ({when})")


def _clock(bench: Mapping[str, Any]) -> Contribution:
    found = (bench.get("daq") or {}).get("clock_ppm")
    if found is None:
        return Contribution(Cause.CLOCK, None, "daq: clock_ppm is not stated")
    return Contribution(Cause.CLOCK, float(found["value"]) * 1e-6 / np.sqrt(3.0), f"daq: {found['source']}")
