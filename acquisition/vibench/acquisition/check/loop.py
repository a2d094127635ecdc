"""Check of the whole signal chain with one sine: the sine's presence, level and phase in each channel."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum, auto
from math import inf, log10, pi, sqrt

import numpy as np

from ..bench import Bench, Bounds, Finding, Verdict, finding_of
from ..instruments import Samples
from ..plan import CHECK_FREQUENCY_HZ, check_phasors, nearest_expected
from ..rig import RESPONSE_ROLES, BaseQuantity, ComplexArray, RigModel, Role
from ..run.silence_watch import BASE_TOLERANCE_DB, DRIVE_TOLERANCE, WRONG_LOAD, SineFit, fit_sine

_PPM = 1e6
_WINDOWS = 20


@dataclass(frozen=True)
class ClockRatio:
    """Relative deviation of the ratio of two clock frequencies from 1."""

    ppm: float
    uncertainty_ppm: float


def clock_ratio(volts: Samples, frequency_hz: float, sample_rate_hz: float) -> ClockRatio:
    """Return the relative deviation of a sine's frequency from ``frequency_hz`` [ppm].

    A straight line is fitted to the phases of twenty windows; its slope is the frequency deviation.
    """
    length = volts.size // _WINDOWS
    starts = np.arange(_WINDOWS) * length
    turned = 2 * pi * frequency_hz * starts / sample_rate_hz
    phases = np.unwrap(
        [
            fit_sine(volts[start : start + length], frequency_hz, sample_rate_hz).phase_rad - turn
            for start, turn in zip(starts, turned, strict=True)
        ]
    )
    line, covariance = np.polyfit(starts / sample_rate_hz, phases, 1, cov=True)
    scale = _PPM / (2 * pi * frequency_hz)
    return ClockRatio(float(line[0]) * scale, sqrt(float(covariance[0, 0])) * scale)


DRIVE_DEVIATION = Bounds(0.02, DRIVE_TOLERANCE)
"""Bounds on the relative deviation of the measured drive voltage from the generator setting."""
GAIN_DB = Bounds(1.0, 3.0)
"""Bounds on the deviation of the amplifier's gain from the rig's model [dB]."""
BASE_DB = Bounds(1.5, BASE_TOLERANCE_DB)
"""Bounds on the deviation of the base's acceleration from the rig's model [dB]."""
CLOCK_PPM = Bounds(100.0, 500.0)
"""Bounds on the deviation of the clock ratio from 1, for two oscillators of 50 ppm each [ppm]."""
DETECTED = 10.0
"""Smallest ratio of amplitude to its uncertainty at which a sine counts as detected."""
PHASE_DEG = Bounds(45.0, 90.0)
"""Bounds on a channel's phase deviation from the rig's model; above 90 degrees the sign is wrong."""
M0_PHASE_DEG = Bounds(90.0, inf)
"""Bounds on m0's phase deviation, which never FAILs because the model of the specimen is less accurate."""
LEFT_OVER = Bounds(0.02, 0.05)
"""Bounds on the fraction of the drive voltage that remains when the output is off."""

AMPLIFIER_GAIN = "amplifier gain"
DRIVE_CLOCK = "drive's clock"
DRIVE_OVER_SETTING = "drive over setting"
BASE_ACCELERATION = "base acceleration"
DRIVE_LEFT = "drive left after stop"


def detection_name(role: Role) -> str:
    """Return the name of the finding that states whether a channel detects the sine."""
    return f"{role.value} detects the sine"


class Lasting(Enum):
    """Kinds of quantities whose changes between two checks are limited."""

    GAIN = auto()
    """A gain; the limit on its change is in decibels."""
    LEVEL = auto()
    CLOCK = auto()


LASTING: Mapping[str, Lasting] = {
    AMPLIFIER_GAIN: Lasting.GAIN,
    DRIVE_CLOCK: Lasting.CLOCK,
    DRIVE_OVER_SETTING: Lasting.LEVEL,
    BASE_ACCELERATION: Lasting.LEVEL,
    **{detection_name(role): Lasting.LEVEL for role in Role},
}
"""Kind of quantity of each finding, keyed by the finding's name."""


class LoopCheck:
    """Check that plays a small sine through the generator and evaluates it at the inputs."""

    def __init__(self, bench: Bench, amplitude_vpp: float, during: Samples, after: Samples) -> None:
        self._rig = bench.rig
        self._rate_hz = bench.digitizer.sample_rate_hz
        self._channels = {channel.role: channel for channel in bench.channels}
        self._rows = dict(zip(self._channels, during, strict=True))
        self._after = dict(zip(self._channels, after, strict=True))
        self._terminal_v = 0.5 * amplitude_vpp * bench.rig.generator.terminal_factor()
        self._amplifier_modelled = np.atleast_1d(
            RigModel(bench.rig).transfer(BaseQuantity.AMPLIFIER_VOLTAGE, CHECK_FREQUENCY_HZ)
        )
        self._base_modelled = check_phasors(bench.rig, self._terminal_v)

    def findings(self) -> list[Finding]:
        """Return the findings on all recorded channels, as measured with the sine."""
        found = [self._alive(role) for role in self._channels]
        if Role.DRIVE_VOLTAGE in self._channels:
            found += [self._drive(), self._silence()]
        # Channels in which the sine is missing were reported above.
        if self._detects(Role.DRIVE_VOLTAGE):
            found.append(self._clocks())
        if self._detects(Role.DRIVE_VOLTAGE) and self._detects(Role.AMPLIFIER_VOLTAGE):
            found += [self._gain(), self._sign(Role.AMPLIFIER_VOLTAGE, self._amplifier_modelled)]
        if self._detects(Role.BASE_ACCELERATION):
            found.append(self._base())
        if self._detects(Role.DRIVE_VOLTAGE) and self._detects(Role.BASE_ACCELERATION):
            found.append(self._sign(Role.BASE_ACCELERATION, self._base_modelled))
        for role in RESPONSE_ROLES:
            if self._detects(Role.DRIVE_VOLTAGE) and self._detects(role):
                modelled = check_phasors(self._rig, self._terminal_v, BaseQuantity(role.value))
                found.append(self._sign(role, modelled, M0_PHASE_DEG))
        return found

    def _detects(self, role: Role) -> bool:
        if role not in self._channels:
            return False
        fit = self._fit(role)
        return fit.amplitude > DETECTED * fit.uncertainty

    def _fit(self, role: Role) -> SineFit:
        volts = self._rows[role] * self._channels[role].units_per_volt
        return fit_sine(volts, CHECK_FREQUENCY_HZ, self._rate_hz)

    def _alive(self, role: Role) -> Finding:
        fit = self._fit(role)
        is_detected = self._detects(role)
        advice = {
            "voltage": "check that the cable is intact and plugged in at both ends, and the amplifier is on",
            "velocity": "check that the laser is on and focused, and that its beam is not blocked",
            "acceleration": "check that the accelerometer is plugged in and that its supply current is on",
        }.get(role.quantity, "check that the sensor is plugged in, within its range, and powered")
        return Finding(
            name=detection_name(role),
            value=f"{fit.amplitude:.3g} +- {fit.uncertainty:.1g} {self._channels[role].unit}",
            expected=f"more than {DETECTED:g} times its uncertainty",
            verdict=Verdict.OK if is_detected else Verdict.FAIL,
            number=fit.amplitude,
            uncertainty=fit.uncertainty,
            unit=self._channels[role].unit,
            advice="" if is_detected else advice,
        )

    def _drive(self) -> Finding:
        fit = self._fit(Role.DRIVE_VOLTAGE)
        ratio = fit.amplitude / self._terminal_v
        verdict = DRIVE_DEVIATION.verdict(abs(ratio - 1))
        advice = "check the cable to the drive_voltage input, and the range and attenuation of this input"
        for wrong in (WRONG_LOAD, 1 / WRONG_LOAD):
            if abs(ratio / wrong - 1) <= DRIVE_DEVIATION.fail:
                advice = (
                    f"a factor of {wrong:g} means a wrong load: compare the load on the generator's panel "
                    "with generator.load_ohm (or the divider with daq.channels.attenuation)"
                )
        return finding_of(
            DRIVE_OVER_SETTING, ratio, "", f"1 within {DRIVE_DEVIATION.well:.0%}", verdict, advice,
            fit.uncertainty / self._terminal_v,
        )  # fmt: skip

    def _silence(self) -> Finding:
        volts = self._after[Role.DRIVE_VOLTAGE] * self._channels[Role.DRIVE_VOLTAGE].units_per_volt
        left = fit_sine(volts, CHECK_FREQUENCY_HZ, self._rate_hz).amplitude / self._terminal_v
        advice = "the output reports 'off' but plays: switch the amplifier off, and have the output repaired"
        return finding_of(
            DRIVE_LEFT,
            left,
            "",
            f"{LEFT_OVER.well:.0%} or less",
            LEFT_OVER.verdict(left),
            advice,
        )

    def _clocks(self) -> Finding:
        ratio = clock_ratio(self._rows[Role.DRIVE_VOLTAGE], CHECK_FREQUENCY_HZ, self._rate_hz)
        verdict = CLOCK_PPM.verdict(abs(ratio.ppm))
        advice = "compare daq.sample_rate_hz with the generator's clock; over minutes, a drift shifts phases"
        expected = f"0 ± {CLOCK_PPM.well:g} ppm"
        return finding_of(DRIVE_CLOCK, ratio.ppm, "ppm", expected, verdict, advice, ratio.uncertainty_ppm)

    def _gain(self) -> Finding:
        drive, output = self._fit(Role.DRIVE_VOLTAGE), self._fit(Role.AMPLIFIER_VOLTAGE)
        relative = sqrt(
            (drive.uncertainty / drive.amplitude) ** 2 + (output.uncertainty / output.amplitude) ** 2
        )
        gain_db = _db(output.amplitude / drive.amplitude)
        expected_db = _db(abs(complex(self._amplifier_modelled[0])))
        verdict = GAIN_DB.verdict(abs(gain_db - expected_db))
        advice = f"set the gain of the {self._rig.amplifier.model} to {self._rig.amplifier.gain_db:g} dB"
        expected = f"{expected_db:.2f} dB within {GAIN_DB.well:g} dB"
        return finding_of(AMPLIFIER_GAIN, gain_db, "dB", expected, verdict, advice, _db(1 + relative))

    def _base(self) -> Finding:
        fit = self._fit(Role.BASE_ACCELERATION)
        modelled = nearest_expected(fit.amplitude, self._base_modelled)
        verdict = BASE_DB.verdict(abs(_db(fit.amplitude / modelled)))
        expected = f"{modelled:.3g} m/s2 within {BASE_DB.well:g} dB"
        advice = "check fixture, specimen, accelerometer sensitivity, and amplifier power and gain"
        return finding_of(
            BASE_ACCELERATION, fit.amplitude, "m/s2", expected, verdict, advice, fit.uncertainty
        )

    def _sign(self, role: Role, modelled: ComplexArray, bounds: Bounds = PHASE_DEG) -> Finding:
        """Compare a channel's phase relative to the drive with the model; 180 degrees mean a wrong sign."""
        turned_rad = self._fit(role).phase_rad - self._fit(Role.DRIVE_VOLTAGE).phase_rad
        each_deg = np.rad2deg((turned_rad - np.angle(modelled) + pi) % (2 * pi) - pi)
        off_deg = each_deg[np.argmin(np.abs(each_deg))]
        advice = {
            Role.BASE_ACCELERATION: "reverse the accelerometer, or swap the wires of the coil or amplifier",
            Role.AMPLIFIER_VOLTAGE: "swap the two wires of this input, or check if the amplifier inverts",
        }.get(
            role,
            "if the sign of the base acceleration is right, this sensor is reversed (its direction, or the "
            "side that the laser hits), or the specimen is not the configured one",
        )
        expected = f"0 ± {bounds.well:g} deg"
        verdict = bounds.verdict(abs(off_deg))
        return finding_of(f"sign of {role.value}", float(off_deg), "deg", expected, verdict, advice)


def _db(ratio: float) -> float:
    return 20 * log10(ratio)
