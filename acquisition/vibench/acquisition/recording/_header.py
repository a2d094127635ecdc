"""Data written before the first sample: channels, rates, plan, bench, instruments, provenance."""

import json
import math
import os
import platform
import re
import shutil
import subprocess
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field, fields
from datetime import UTC, datetime
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import ClassVar

import h5py

from vibench.sim.engine.library import native_digest

from ..errors import RecordingError
from ..instruments import Identity
from ._layout import RESERVED_NAMES, ROLE_WIDTH, Attribute, Origin, json_text

CHECKOUT = Path(__file__).resolve().parents[4]
PACKAGES = ("vibench", "numpy", "scipy", "h5py", "pydantic", "pyvisa", "pyvisa-py", "nidaqmx")
GIT_PATIENCE_S = 5.0


@dataclass(frozen=True)
class Provenance:
    """Software and computer that made a recording."""

    started_utc: str
    """Start time in ISO 8601 with microseconds, from the computer's clock."""
    host: str
    platform: str
    process: int
    python: str
    packages: Mapping[str, str]
    """Version of each package that affects the data, and digest of the native engine's sources."""
    commit: str
    """Git commit of the checkout (``+changes`` if files were modified); empty for an installed wheel."""


def collect_provenance() -> Provenance:
    """Return the provenance of this process, machine and installation."""
    return Provenance(
        started_utc=datetime.now(UTC).isoformat(timespec="microseconds"),
        host=platform.node(),
        platform=platform.platform(),
        process=os.getpid(),
        python=platform.python_version(),
        packages=_package_versions(),
        commit=_commit(),
    )


@cache
def _package_versions() -> Mapping[str, str]:
    found = {"hdf5": str(h5py.version.hdf5_version), "native engine": native_digest()}
    for name in PACKAGES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "not installed"
    return found


@cache
def _commit() -> str:
    """Return the commit of the checkout; empty for an installed wheel."""
    if not (CHECKOUT / ".git").exists():
        return ""
    commit = _git("rev-parse", "HEAD")
    changes = _git("status", "--porcelain", "--untracked-files=no")
    return f"{commit}+changes" if commit and changes else commit


def _git(*arguments: str) -> str:
    git = shutil.which("git")
    if git is None:
        return ""
    try:
        answer = subprocess.run(  # noqa: S603 - fixed arguments, no shell
            [git, "-C", str(CHECKOUT), *arguments],
            capture_output=True,
            text=True,
            timeout=GIT_PATIENCE_S,
            check=False,
        )
    except (OSError, subprocess.TimeoutExpired):
        return ""
    return answer.stdout.strip() if answer.returncode == 0 else ""


ROLE_PATTERN = re.compile(r"[a-z][a-z0-9_]*")
COUPLINGS = ("AC", "DC")
_AC_CUT_HZ = 0.5
"""-3 dB frequency of the first-order AC coupling of NI 9234, 4431 and similar modules [Hz]."""
OPTIONAL = ("sensitivity", "volts_per_count")
"""Numbers that may be unknown; an unknown number is NaN in the file and None in a header."""
UNPLANNED = -1
"""Value of ``expected_samples`` in the file if the recording has no planned end."""

FINE_STEP = 2.0**-30
"""Step of stored counts if the converter's step is unknown, as a fraction of the range.

With this step, twice the range still fits into an int32; 2^-30 is 42 dB below a 24-bit converter's step.
"""


@dataclass(frozen=True)
class ChannelHeader:
    """One recorded channel: source and scale of its counts.

    ``physical = physical_per_volt * volts + physical_offset``
    """

    OWN_UNITS: ClassVar = {
        "physical_per_volt": "{0.unit} V-1",
        "physical_offset": "{0.unit}",
        "volts_per_count": "V",
        "volts_at_zero_count": "V",
        "sensitivity": "{0.sensitivity_unit}",
    }
    """Units of those values whose names contain no unit; ``{0.unit}`` is the channel's unit."""

    role: str
    """Name of the channel in the file: ``"drive_voltage"``, ``"m0_velocity"``."""
    physical_channel: str
    """Name of the input in the converter's driver: ``"cDAQ1Mod1/ai0"``."""
    quantity: str
    """Quantity: ``"voltage"``, ``"acceleration"``, ``"velocity"``, ``"displacement"``, ``"force"``."""
    unit: str
    """Unit of the physical value in UDUNITS notation: ``"V"``, ``"m s-2"``, ``"m s-1"``."""
    physical_per_volt: float
    range_v: float
    """Full scale of the input, symmetric about zero [V]."""
    volts_per_count: float | None = None
    """Step of the converter [V]; None if unknown (the stored step is then 2^-30 of the range)."""
    volts_at_zero_count: float = 0.0
    """Voltage at count zero, from the converter's calibration [V]."""
    physical_offset: float = 0.0
    coupling: str = "AC"
    """Coupling of the input, ``"AC"`` or ``"DC"``."""
    iepe_current_a: float = 0.0
    sensitivity: float | None = None
    """Sensitivity from the calibration sheet, in ``sensitivity_unit``."""
    sensitivity_unit: str = ""
    serial: str = ""
    calibration_date: str = ""
    """ISO date of the sensor's calibration."""
    delay_s: float = 0.0
    """Delay of the channel, for example by a vibrometer's decoder [s]."""
    long_name: str = ""

    def __post_init__(self) -> None:
        if (
            not ROLE_PATTERN.fullmatch(self.role)
            or self.role in RESERVED_NAMES
            or len(self.role) > ROLE_WIDTH
        ):
            raise RecordingError(
                f"The channel name {self.role!r} is not allowed: use lower-case letters, digits and"
                f" underscores, beginning with a letter, at most {ROLE_WIDTH}, and none of"
                f" {', '.join(sorted(RESERVED_NAMES))}."
            )
        if self.coupling not in COUPLINGS:
            raise RecordingError(
                f"The coupling of {self.role!r} is {self.coupling!r}; allowed are {' and '.join(COUPLINGS)}."
            )
        _require_positive(f"range_v of {self.role!r}", self.range_v)
        if self.volts_per_count is not None:
            _require_positive(f"volts_per_count of {self.role!r}", self.volts_per_count)
        if not math.isfinite(self.physical_per_volt) or self.physical_per_volt == 0.0:
            raise RecordingError(
                f"physical_per_volt of {self.role!r} is {self.physical_per_volt};"
                " it must be finite and not zero."
            )

    @property
    def step_v(self) -> float:
        """Voltage step between two neighbouring stored counts [V]."""
        return self.range_v * FINE_STEP if self.volts_per_count is None else self.volts_per_count

    @property
    def scale_factor(self) -> float:
        """Physical value of one count of the converter, without offset."""
        return self.physical_per_volt * self.step_v

    @property
    def add_offset(self) -> float:
        """Physical value at count zero of the converter."""
        return self.physical_per_volt * self.volts_at_zero_count + self.physical_offset

    def attributes(self) -> dict[str, Attribute]:
        """Return the attributes of the channel's dataset: those of CF, then the fields of this header."""
        own = {each.name: getattr(self, each.name) for each in fields(self)}
        del own["role"], own["unit"]
        own["long_name"] = self.long_name or self.role.replace("_", " ")
        absent = {name: math.nan for name in OPTIONAL if own[name] is None}
        return {
            "units": self.unit,
            "scale_factor": self.scale_factor,
            "add_offset": self.add_offset,
            "volts_per_stored_count": self.step_v,
            **own,
            **absent,
        }


@dataclass(frozen=True)
class RecordingHeader:
    """Data written before the first sample."""

    channels: tuple[ChannelHeader, ...]
    """Recorded channels, in the row order of a block."""
    sample_rate_hz: float
    """Actual sample rate of the hardware [samples/s]."""
    expected_samples: int | None
    """Planned number of samples per channel; None if the recording has no planned end."""
    origin: Origin
    plan_json: str = "{}"
    """Complete plan of the measurement, as JSON."""
    bench_json: str = "{}"
    """Complete bench configuration, as JSON."""
    requested_sample_rate_hz: float | None = None
    """Requested sample rate [samples/s]; None if it equals the actual rate."""
    instruments: Mapping[str, Identity] = field(default_factory=dict)
    """Identities of the instruments by their role (``"generator"``, ``"digitizer"``)."""
    confirmations: Mapping[str, str | float] = field(default_factory=dict)
    """Settings confirmed by the operator: amplifier gain, vibrometer range and filters."""
    bench_check_json: str = "{}"
    """Result of the last bench check as JSON; ``{}`` if there was no check."""
    provenance: Provenance = field(default_factory=collect_provenance)

    def __post_init__(self) -> None:
        require_different(self.channels)
        _require_positive("sample_rate_hz", self.sample_rate_hz)
        if self.expected_samples is not None:
            _require_positive("expected_samples", self.expected_samples)
        for name, text in (
            ("plan_json", self.plan_json),
            ("bench_json", self.bench_json),
            ("bench_check_json", self.bench_check_json),
        ):
            try:
                parsed = json.loads(text)
            except ValueError as error:
                raise RecordingError(
                    f"{name} is not JSON ({error}); give the JSON text of the plan or bench."
                ) from error
            if not isinstance(parsed, dict):
                raise RecordingError(f"{name} is a JSON {type(parsed).__name__}; it must be an object.")

    def configuration(self) -> dict[str, str]:
        """Return the texts of the group ``/configuration``, all as JSON."""
        instruments = {name: asdict(identity) for name, identity in self.instruments.items()}
        return {
            "plan_json": self.plan_json,
            "bench_json": self.bench_json,
            "instruments_json": json.dumps(instruments),
            "confirmations_json": json_text("The operator's confirmations", self.confirmations),
            "bench_check_json": self.bench_check_json,
            "provenance_json": json.dumps(asdict(self.provenance)),
        }

    def attributes(self) -> dict[str, Attribute]:
        """Return the attributes of the file, except its format and its identifier."""
        point = json.loads(self.plan_json).get("point")
        place = point if isinstance(point, dict) else {}
        return {
            **{f"point_{name}": value for name, value in place.items() if value is not None},
            "sample_rate_hz": float(self.sample_rate_hz),
            "requested_sample_rate_hz": float(self.requested_sample_rate_hz or self.sample_rate_hz),
            "expected_samples": UNPLANNED if self.expected_samples is None else self.expected_samples,
            "origin": self.origin.value,
            "started_utc": self.provenance.started_utc,
            "software_version": self.provenance.packages.get("vibench", ""),
            "software_commit": self.provenance.commit,
            "roles": " ".join(channel.role for channel in self.channels),
        }


def require_different(channels: Iterable[ChannelHeader]) -> tuple[ChannelHeader, ...]:
    """Return the channels; raises RecordingError if there are none, or two channels share a name."""
    given = tuple(channels)
    roles = [channel.role for channel in given]
    if not roles or len(set(roles)) != len(roles):
        raise RecordingError(f"A recording needs one or more channels with different names; given: {roles}.")
    return given


def _require_positive(name: str, value: float) -> None:
    if not (math.isfinite(value) and value > 0):
        raise RecordingError(f"{name} is {value}; it must be finite and greater than zero.")


def coupling_cut_hz(coupling: str) -> float:
    """Return the -3 dB frequency of the first-order high-pass of a ``coupling`` [Hz]; 0 for ``"DC"``."""
    return _AC_CUT_HZ if coupling == "AC" else 0.0
