"""Check of the drive before a run, and measurement of its silence after a stop.

If reading has stalled, samples that are read after a command may have been converted before the command.
"""

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from math import hypot, inf, sqrt
from time import monotonic

import numpy as np

from ..errors import AcquisitionError, CheckFailed, InstrumentError
from ..host import LOG
from ..host.beside import ClosedOnLeaving
from ..instruments import Block, Samples
from ..plan import CHECK_FREQUENCY_HZ, check_phasors, nearest_expected
from ..rig import Channel, Rig, Role
from ..stopping.program import Watchdog
from ..stopping.stop import DRIVES_ON, MEMORY_RESERVE, Cause, StopLevel, StopRequest, StopSwitch
from .acquisition_loop import BLOCK_S
from .drive import Drive

DRIVE_TOLERANCE = 0.15
"""Relative tolerance of the measured drive; a wrong load setting would change the drive by a factor of 2."""
BASE_TOLERANCE_DB = 3.0
"""Tolerance of the measured base acceleration relative to the model [dB]."""
WRONG_LOAD = 2.0
QUIET_SHARE = 0.25
"""Largest input signal before anything plays, as a fraction of the signal expected from the sine."""
STILL_SHARE = 0.3
"""Fraction of the quiet record, at its start, that is ignored because filter and table may still ring."""


class LowLevelCheck(StrEnum):
    """Whether a run starts with a bench check."""

    AT_LOW_LEVEL = "at low level"
    RECENTLY_PASSED = "recently passed"
    """No check, because the bench was checked in the same session and has not changed since."""


@dataclass(frozen=True)
class CheckFigures:
    """Results of the check before a run; amplitudes are peak values of the sine."""

    drive_v: float
    expected_drive_v: float
    base_m_per_s2: float
    expected_base_m_per_s2: float

    def text(self) -> str:
        """Return the results of the check as one line for the log."""
        return (
            f"drive {self.drive_v:.4g} V ({self.expected_drive_v:.4g} V expected), "
            f"base {self.base_m_per_s2:.4g} m/s2 ({self.expected_base_m_per_s2:.4g} m/s2 expected) "
            f"at {CHECK_FREQUENCY_HZ:g} Hz"
        )


def check_figures(
    rig: Rig,
    channels: tuple[Channel, ...],
    quiet: Samples,
    during: Samples,
    sample_rate_hz: float,
    amplitude_vpp: float,
) -> CheckFigures:
    """Return the results of the check, after comparing them with the expected values.

    Raises CheckFailed with the deviation and advice. ``quiet`` and ``during`` are the input voltages before
    and while the sine plays, shape (channels, samples) each [V].
    """
    quiet = quiet[:, round(STILL_SHARE * quiet.shape[1]) :]
    drive = _row(channels, Role.DRIVE_VOLTAGE)
    base = _row(channels, Role.BASE_ACCELERATION)
    terminal_v = 0.5 * amplitude_vpp * rig.generator.terminal_factor()

    def amplitude(volts: Samples, row: int) -> float:
        fit = fit_sine(volts[row], CHECK_FREQUENCY_HZ, sample_rate_hz)
        return fit.amplitude * channels[row].units_per_volt

    moved = amplitude(during, base)
    expected = nearest_expected(moved, check_phasors(rig, terminal_v))
    figures = CheckFigures(amplitude(during, drive), terminal_v, moved, expected)
    _require_quiet("the drive voltage", amplitude(quiet, drive), figures.expected_drive_v, "V")
    _require_quiet("the base acceleration", amplitude(quiet, base), figures.expected_base_m_per_s2, "m/s2")
    _require_drive(figures)
    _require_base(figures)
    return figures


@dataclass(frozen=True)
class SineFit:
    """Sine fitted to samples by least squares."""

    amplitude: float
    uncertainty: float
    """Standard uncertainty of the amplitude, from the residual of the fit."""
    phase_rad: float
    """Phase of the cosine at the first sample [rad]."""


def fit_sine(volts: Samples, frequency_hz: float, sample_rate_hz: float) -> SineFit:
    """Return the least-squares fit of a cosine, a sine, a constant and a linear drift.

    The uncertainty assumes white noise: ``residual * sqrt(2 / n)`` (Kay, Fundamentals of Statistical Signal
    Processing, vol. 1, example 3.14). ``volts`` must span more than one period of the sine.
    """
    time_s = np.arange(volts.size) / sample_rate_hz
    angle = 2 * np.pi * frequency_hz * time_s
    basis = np.stack([np.cos(angle), np.sin(angle), np.ones_like(angle), time_s], axis=1)
    solution = np.linalg.lstsq(basis, volts)[0]
    residual = float(np.sqrt(np.mean((volts - basis @ solution) ** 2)))
    in_phase, quadrature = float(solution[0]), float(solution[1])
    return SineFit(
        amplitude=hypot(in_phase, quadrature),
        uncertainty=residual * sqrt(2 / volts.size),
        phase_rad=float(np.arctan2(-quadrature, in_phase)),
    )


def require_checkable(channels: tuple[Channel, ...]) -> None:
    """Raise CheckFailed if the rig has no channel for the drive voltage or the base acceleration."""
    for role in (Role.DRIVE_VOLTAGE, Role.BASE_ACCELERATION):
        _row(channels, role)


def _row(channels: tuple[Channel, ...], role: Role) -> int:
    roles = [channel.role for channel in channels]
    if role not in roles:
        raise CheckFailed(
            f"the rig has no {role.value} channel, which must show the signal sent to the shaker. "
            "Nothing was played; connect this signal and add its channel to daq.channels"
        )
    return roles.index(role)


def _require_quiet(what: str, found: float, expected: float, unit: str) -> None:
    if found > QUIET_SHARE * expected:
        raise CheckFailed(
            f"{what} shows {found:.3g} {unit} at {CHECK_FREQUENCY_HZ:g} Hz before any signal is played, more "
            f"than a quarter of the expected {expected:.3g} {unit}. The output stayed off; "
            "look for another signal source at the amplifier, mains hum, or a loose cable"
        )


def _require_drive(figures: CheckFigures) -> None:
    ratio = figures.drive_v / figures.expected_drive_v
    if abs(ratio - 1) <= DRIVE_TOLERANCE:
        return
    measured = f"the measured drive is {figures.drive_v:.3g} V, but {figures.expected_drive_v:.3g} V were set"
    if abs(ratio / WRONG_LOAD - 1) <= DRIVE_TOLERANCE or abs(ratio * WRONG_LOAD - 1) <= DRIVE_TOLERANCE:
        advice = "a factor of 2 means a wrong load: compare the generator's load setting with load_ohm"
    else:
        advice = (
            "check the wire from the generator (or from the analogue output) to the drive_voltage "
            "input, and the range and attenuation of this input"
        )
    raise CheckFailed(
        f"{measured}; a deviation of {DRIVE_TOLERANCE:.0%} is allowed. The output was turned off; {advice}"
    )


def _require_base(figures: CheckFigures) -> None:
    factor = 10 ** (BASE_TOLERANCE_DB / 20)
    if 1 / factor <= figures.base_m_per_s2 / figures.expected_base_m_per_s2 <= factor:
        return
    raise CheckFailed(
        f"the base acceleration is {figures.base_m_per_s2:.3g} m/s2, but the model predicts "
        f"{figures.expected_base_m_per_s2:.3g} m/s2; {BASE_TOLERANCE_DB:g} dB deviation is allowed. The "
        "output was turned off; check the amplifier's gain and power, the accelerometer and its sensitivity, "
        "the moving mass, and that the specimen is the one in the hardware configuration"
    )


SILENT_V = 5e-3
"""Half of the largest peak-to-peak voltage that counts as silence (noise, hum, smallest setting) [V]."""
HUM_FACTOR = 2.0
"""A signal up to this multiple of the hum before the run counts as silence, even above `SILENT_V`."""
LISTEN_S = 0.02
"""Step of the search for silence: one period of the mains [s]."""
LONGEST_S = 12.0
"""Longest search for silence [s], longer than the converter's buffer."""
LOWER_AFTER_S = 1.0
"""Time after which the amplitude is lowered if the drive is still measured [s]: the relay may be stuck."""
STILL_ON = 0.1
"""Fraction of the largest recorded drive above which a remaining signal cannot be hum."""


class SilenceWatch:
    """Monitor of the recorded drive, from a stop until silence."""

    def __init__(self, channels: tuple[Channel, ...], sample_rate_hz: float) -> None:
        self._row = [channel.role for channel in channels].index(Role.DRIVE_VOLTAGE)
        self._volts_per_volt = channels[self._row].units_per_volt
        self._sample_rate_hz = sample_rate_hz
        self._silent_v = SILENT_V
        self._begin = 0
        self._last_loud = -1
        self._residue_v = inf
        self._loudest_v = 0.0
        self.is_heard = False
        """Whether the drive was still measured after its output was switched off."""

    def learn_hum(self, quiet: Samples) -> None:
        """Set the limit of silence from ``quiet``: samples without drive, shape (channels, samples) [V]."""
        drive = self._drive(quiet)[round(STILL_SHARE * quiet.shape[1]) :]
        self._silent_v = max(SILENT_V, HUM_FACTOR * _half_peak_to_peak(drive))

    def begin(self, sample: int) -> None:
        """Start the measurement of silence; the stop was noticed before sample number ``sample``."""
        self._begin, self._last_loud, self._residue_v = sample, sample - 1, inf

    def take(self, block: Block) -> None:
        """Add the next samples of all channels."""
        drive = self._drive(block.volts)
        self._residue_v = _half_peak_to_peak(drive)
        self._loudest_v = max(self._loudest_v, self._residue_v)
        # The silent end of a block lies within the limit peak to peak, so that an offset of the input is
        # no signal, and the length of the block does not matter: after a stall it is long.
        newest_first = drive[::-1]
        span_v = np.maximum.accumulate(newest_first) - np.minimum.accumulate(newest_first)
        silent = int(np.searchsorted(0.5 * span_v, self._silent_v, side="right"))
        if silent < drive.size:
            self._last_loud = block.first_sample + drive.size - 1 - silent

    @property
    def is_silent(self) -> bool:
        """Whether the drive is silent in the newest samples."""
        return self._residue_v <= self._silent_v

    def text(self) -> str:
        """Return the time from stop to silence as text."""
        took_s = (self._last_loud + 1 - self._begin) / self._sample_rate_hz
        if self.is_silent and self.is_heard:
            seen = f"{took_s:.3f} s after the stop was seen (now {self._residue_v:.2g} V)"
            return f"not silent after switching off: the output's amplitude had to be lowered, {seen}"
        if self.is_silent:
            return f"{took_s:.3f} s after the stop was seen, silence was measured ({self._residue_v:.2g} V)"
        return f"not silent {took_s:.3f} s after the stop was seen: {self._residue_v:.2g} V at the amplifier"

    def note_signal(self) -> None:
        """Store whether more than hum remains after the output has been switched off."""
        self.is_heard |= not self.is_silent and self._residue_v > STILL_ON * self._loudest_v

    def require_silence(self) -> None:
        """Raise InstrumentError if more than hum remained after switching off."""
        self.note_signal()
        if self.is_heard:
            raise InstrumentError(
                f"the drive is {self.text()}. The output was commanded off, and the recording is kept; THE "
                "OUTPUT MAY STILL BE ON: switch the amplifier off by hand"
            )

    def _drive(self, volts: Samples) -> Samples:
        return np.asarray(volts[self._row] * self._volts_per_volt)


def _half_peak_to_peak(volts: Samples) -> float:
    return 0.5 * float(np.ptp(volts)) if volts.size else inf


STANDSTILL_BLOCKS = 50
"""Number of missed blocks after which the drive is switched off; half a converter's default buffer."""
STOPPED_BLOCKS = 15
"""Number of missed blocks that are allowed after a stop was requested."""
_LONGEST_ROUND_S = 0.1
"""Longest interval between checks that is fully counted [s]; in a longer one, the process was suspended."""


class DriveGuard(ClosedOnLeaving):
    """Guard that switches the drive off if the run stops reading; thread and memory are reserved in advance.

    The run calls the guard when its drive starts and after every block. The drive counts as on until its
    output has been read back as off.
    """

    def __init__(
        self, drive: Drive, switch: StopSwitch, is_heard: Callable[[], bool] = lambda: False
    ) -> None:
        """``is_heard`` returns whether the drive was still measured after its output was switched off.

        Raises AcquisitionError when the system provides no thread, or no memory for the reserve.
        """
        MEMORY_RESERVE.hold()
        self._drive = drive
        self._switch = switch
        self._is_heard = is_heard
        reason = (
            f"the run read no samples for {STANDSTILL_BLOCKS * BLOCK_S:g} s; its output was switched off. "
            "Find out what slows down this computer or its disk, then start again"
        )
        self._standstill = StopRequest(Cause.FAULT, StopLevel.OFF, reason)
        self._blocks = self._seen = 0
        self._still_s, self._round_s = 0.0, monotonic()
        self._has_begun = self._is_cut = self._is_leaving = self._has_failed = False
        self._watchdog = Watchdog(self._look, "drive guard")

    def begin(self, generator: str = "") -> None:
        """Register the start of the drive of a ``generator``."""
        DRIVES_ON.begin(self, generator)
        self._still_s, self._has_begun = 0.0, True

    def advance(self) -> None:
        """Register that a block of samples was read."""
        self._blocks += 1
        DRIVES_ON.note_advance()

    def silence(self) -> None:
        """Silence the drive with `Drive.silence`; if memory is exhausted, release the reserve and repeat."""
        self._is_leaving = True
        try:
            self._drive.silence()
        except MemoryError:
            MEMORY_RESERVE.release()
            self._drive.silence()
        self._has_begun = False
        self._confirm()

    def close(self) -> None:
        """Stop monitoring, at any time; a drive that is not confirmed as off stays listed as on."""
        self._watchdog.close()

    def _look(self) -> None:
        now_s = monotonic()
        self._still_s += min(now_s - self._round_s, _LONGEST_ROUND_S)
        self._round_s = now_s
        if self._blocks != self._seen:
            self._seen, self._still_s, self._is_cut = self._blocks, 0.0, False
        is_stopping = self._is_leaving or self._switch.request is not None
        blocks = STOPPED_BLOCKS if is_stopping else STANDSTILL_BLOCKS
        if self._has_begun and self._still_s > blocks * BLOCK_S:
            self._silence_standstill()

    def _silence_standstill(self) -> None:
        if self._is_cut:
            return
        if not self._is_leaving:
            self._switch.ask(self._standstill)
        try:
            self._drive.cut()
            self._drive.silence()  # Lower the amplitude too: silence cannot be measured.
        except AcquisitionError as error:  # The next check tries again.
            LOG.debug("the drive guard could not silence the drive", exc_info=True)
            if not self._has_failed:
                LOG.error("%s", error)
            self._has_failed = True
            return
        self._is_cut = True
        self._confirm()

    def _confirm(self) -> None:
        if not self._is_heard():
            DRIVES_ON.confirm_silence(self)
