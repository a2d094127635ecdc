"""The check of the bench at low level: does the drive arrive, and does the base move as the model says?"""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from ..errors import CheckFailed
from ..instruments import Samples
from ..plan import CHECK_FREQUENCY_HZ, expected_under_check, nearest_expected
from ..rig import Channel, Rig, Role

DRIVE_TOLERANCE = 0.15
"""How far the measured drive may lie from the setting: a wrong load is a factor of 2, a cable is nothing."""
BASE_FACTOR = 10 ** (3 / 20)
"""How far the base acceleration may lie from the model, specimen included: 3 dB, either way."""
WRONG_LOAD = 2.0
QUIET_SHARE = 0.25
"""Share of the expected signal that may be there before anything plays."""
STILL_SHARE = 0.3
"""Share of the quiet stretch that is not judged: what a run before was cut off at is still in the converter's
filter, and the table still moves."""


class LowLevelCheck(StrEnum):
    """Whether a run begins with the check of the bench."""

    AT_LOW_LEVEL = "at low level"
    RECENTLY_PASSED = "recently passed"
    """The bench was checked in the same session and nothing was touched since."""


@dataclass(frozen=True)
class CheckFigures:
    """What the check measured, as peak amplitudes of the sine."""

    drive_v: float
    expected_drive_v: float
    base_m_per_s2: float
    expected_base_m_per_s2: float

    def text(self) -> str:
        """One line for the log."""
        return (
            f"drive {self.drive_v:.4g} V ({self.expected_drive_v:.4g} V expected), "
            f"base {self.base_m_per_s2:.4g} m/s2 ({self.expected_base_m_per_s2:.4g} m/s2 expected) "
            f"at {CHECK_FREQUENCY_HZ:g} Hz"
        )


def judged(
    rig: Rig,
    channels: tuple[Channel, ...],
    quiet: Samples,
    during: Samples,
    sample_rate_hz: float,
    amplitude_vpp: float,
) -> CheckFigures:
    """Compare what was measured before and while the check's sine played with what should be there.

    Parameters
    ----------
    quiet, during
        Volts before, and while, the sine plays: shape (channels, samples) each [V].

    Raises
    ------
    CheckFailed
        Saying what does not fit and where to look.

    """
    quiet = quiet[:, round(STILL_SHARE * quiet.shape[1]) :]
    drive = _row(channels, Role.DRIVE_VOLTAGE)
    base = _row(channels, Role.BASE_ACCELERATION)
    terminal_v = 0.5 * amplitude_vpp * rig.generator.terminal_factor()

    def measured(volts: Samples, row: int) -> float:
        return sine_amplitude(volts[row], CHECK_FREQUENCY_HZ, sample_rate_hz) * channels[row].units_per_volt

    moved = measured(during, base)
    expected = nearest_expected(moved, expected_under_check(rig, terminal_v))
    figures = CheckFigures(measured(during, drive), terminal_v, moved, expected)
    _require_quiet("the drive voltage", measured(quiet, drive), figures.expected_drive_v, "V")
    _require_quiet("the base acceleration", measured(quiet, base), figures.expected_base_m_per_s2, "m/s2")
    _require_drive(figures)
    _require_base(figures)
    return figures


def sine_amplitude(volts: Samples, frequency_hz: float, sample_rate_hz: float) -> float:
    """Amplitude of the sine at a known frequency: least squares beside a constant and a drift.

    Parameters
    ----------
    volts
        Shape (samples,) [V]; any length of more than a period.

    """
    time_s = np.arange(len(volts)) / sample_rate_hz
    angle = 2 * np.pi * frequency_hz * time_s
    basis = np.stack([np.cos(angle), np.sin(angle), np.ones_like(angle), time_s], axis=1)
    solution = np.linalg.lstsq(basis, volts)[0]
    return float(np.hypot(solution[0], solution[1]))


def require_checkable(channels: tuple[Channel, ...]) -> None:
    """Refuse a rig without the two channels that every safe run needs."""
    for role in (Role.DRIVE_VOLTAGE, Role.BASE_ACCELERATION):
        _row(channels, role)


def _row(channels: tuple[Channel, ...], role: Role) -> int:
    roles = [channel.role for channel in channels]
    if role not in roles:
        raise CheckFailed(
            f"the rig has no {role.value} channel, without which nobody sees what the shaker gets. "
            "Nothing was played; connect it and add it to daq.channels"
        )
    return roles.index(role)


def _require_quiet(what: str, found: float, expected: float, unit: str) -> None:
    if found > QUIET_SHARE * expected:
        raise CheckFailed(
            f"{what} shows {found:.3g} {unit} at {CHECK_FREQUENCY_HZ:g} Hz before anything plays, "
            f"a quarter of the {expected:.3g} {unit} to come would be too much. The output stayed off; "
            "look for another source on the amplifier, hum, or a loose cable"
        )


def _require_drive(figures: CheckFigures) -> None:
    ratio = figures.drive_v / figures.expected_drive_v
    if abs(ratio - 1) <= DRIVE_TOLERANCE:
        return
    measured = f"the drive measures {figures.drive_v:.3g} V where {figures.expected_drive_v:.3g} V were set"
    if abs(ratio / WRONG_LOAD - 1) <= DRIVE_TOLERANCE or abs(ratio * WRONG_LOAD - 1) <= DRIVE_TOLERANCE:
        advice = "a factor of 2 is a wrong load: compare the generator's load setting with load_ohm"
    else:
        advice = (
            "check the wire from the generator (or analogue output, if that plays) to the drive_voltage "
            "input, its range and attenuation"
        )
    raise CheckFailed(
        f"{measured}, {DRIVE_TOLERANCE:.0%} off is allowed. The output was turned off; {advice}"
    )


def _require_base(figures: CheckFigures) -> None:
    ratio = figures.base_m_per_s2 / figures.expected_base_m_per_s2
    if 1 / BASE_FACTOR <= ratio <= BASE_FACTOR:
        return
    raise CheckFailed(
        f"the base moves with {figures.base_m_per_s2:.3g} m/s2 where the model says "
        f"{figures.expected_base_m_per_s2:.3g} m/s2, 3 dB off is allowed. The output was turned off; "
        "check the amplifier's gain and power, the accelerometer and its sensitivity, the moving mass, and "
        "whether the specimen is the one that the rig names"
    )
