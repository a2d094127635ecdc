"""Which calibrations have run out."""

from dataclasses import dataclass
from datetime import date
from enum import StrEnum, auto

from ..errors import CheckFailed
from ._channel import channels_of
from ._configuration import Rig


class CalibrationRule(StrEnum):
    """What a calibration that has run out does."""

    ENFORCED = auto()
    """The bench does not open."""
    WAIVED = auto()
    """The bench opens; the dates stand in every recording."""


@dataclass(frozen=True)
class Calibration:
    """One calibration and its age."""

    what: str
    calibrated: date
    age_days: int
    valid_days: int

    @property
    def is_to_come(self) -> bool:
        """Whether its date is a slip of the pen."""
        return self.age_days < 0

    @property
    def is_valid(self) -> bool:
        """Whether it holds today; a date to come does not."""
        return 0 <= self.age_days <= self.valid_days

    @property
    def advice(self) -> str:
        """What to do about one that does not hold."""
        if self.is_to_come:
            return "the date is still to come: enter the one on the certificate in the configuration"
        return "have it calibrated, and enter the date in the configuration"

    def __str__(self) -> str:
        when = "a day that is still to come" if self.is_to_come else f"{self.age_days} days ago"
        return f"{self.what} was calibrated on {self.calibrated}, {when}"


def calibrations(rig: Rig, today: date) -> tuple[Calibration, ...]:
    """Every calibration of a rig: that of each sensor which tells one, and each input's.

    Parameters
    ----------
    rig
        Whose sheets are read.
    today
        Their ages are counted to it.

    """
    channels = channels_of(rig)
    sensors = {channel.sensor: channel.sensor_calibrated for channel in channels if channel.sensor_calibrated}
    inputs = {
        f"{channel.physical} of {rig.daq.product}": channel.converter_calibrated for channel in channels
    }
    return tuple(
        Calibration(what, calibrated, (today - calibrated).days, rig.calibration_valid_days)
        for what, calibrated in (*sensors.items(), *inputs.items())
    )


def check_calibrations(rig: Rig, today: date) -> None:
    """Refuse a rig of which a calibration has run out.

    Parameters
    ----------
    rig
        Whose sheets are read.
    today
        Their ages are counted to it.

    Raises
    ------
    CheckFailed
        When one has run out; it names each.

    """
    stale = [str(calibration) for calibration in calibrations(rig, today) if not calibration.is_valid]
    if stale:
        raise CheckFailed(
            f"{'; '.join(stale)}; {rig.calibration_valid_days} days are allowed (calibration_valid_days). "
            "Nothing was opened; have it calibrated, enter the date on its certificate, or waive the rule"
        )
