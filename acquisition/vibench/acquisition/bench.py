"""Open the instruments of a rig, all or none, and close them with the generator silent.

`open_bench` opens a rig's generator, converter and analogue output, for only one program at a time
(`BenchLock`); `list_instruments` lists the instruments that could be opened. The module also defines the
findings and the stored result of a bench check. Only this module starts simulated instruments: it loads
`vibench.virtual_rig` by name when a configuration has a table ``[virtual]``.
"""

import json
import os
import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, ExitStack, closing, contextmanager
from copy import copy
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta
from enum import StrEnum
from getpass import getuser
from hashlib import sha256
from importlib import import_module
from pathlib import Path
from threading import Event as Alarm
from typing import Any, Self, cast

from pydantic import AwareDatetime, Field

from vibench.sim.operating_system.this import (
    is_locked_alone,
    open_for_all,
    read_at,
    shared_folder,
    state_folder,
    write_at,
)

from . import drivers
from .errors import AcquisitionError, InstrumentBusy, InstrumentError
from .host.toml_file import FrozenModel, member
from .instruments import (
    AnalogOutput,
    Block,
    Digitizer,
    FoundDevice,
    FunctionGenerator,
    Identity,
    PlugInKind,
    RealTimeController,
    plug_in,
)
from .rig import (
    CalibrationRule,
    Channel,
    Confirm,
    KnobSheet,
    Rig,
    Role,
    channels_of,
    check_calibrations,
    confirm_at_terminal,
    confirm_simulated,
    digitizer_driver,
    generator_driver,
    load_rig,
    output_driver,
)
from .stopping.program import note_open_bench


class Verdict(StrEnum):
    """Verdict on one finding of a bench check."""

    OK = "ok"
    WARN = "warn"
    """Warning: find the cause of the deviation, because measurements may be less accurate."""
    FAIL = "fail"
    """Failure: remove the cause before you switch the drive on."""


_ORDER = (Verdict.OK, Verdict.WARN, Verdict.FAIL)


class Finding(FrozenModel):
    """One result of a bench check."""

    name: str = Field(min_length=1)
    value: str
    """Measured value as text, with unit and uncertainty."""
    expected: str
    verdict: Verdict
    number: float | None = None
    """Measured value as a number in ``unit``; None if the value is only a text."""
    uncertainty: float | None = None
    """Standard uncertainty of the number, in ``unit``."""
    unit: str = ""
    advice: str = ""
    """Advice on what to do; empty if the verdict is ok."""


@dataclass(frozen=True)
class Bounds:
    """Bounds on a deviation: ok up to ``well``, a warning from ``well`` to ``fail``, otherwise a failure."""

    well: float
    fail: float

    def verdict(self, deviation: float) -> Verdict:
        """Return the verdict on a deviation; a NaN counts as FAIL."""
        if deviation <= self.well:
            return Verdict.OK
        return Verdict.WARN if deviation <= self.fail else Verdict.FAIL


def finding_of(
    name: str,
    number: float,
    unit: str,
    expected: str,
    verdict: Verdict,
    advice: str,
    uncertainty: float | None = None,
) -> Finding:
    """Return the finding for a measured number; the advice is included only if the verdict is not ok."""
    spread = "" if uncertainty is None else f" +- {uncertainty:.1g}"
    return Finding(
        name=name,
        value=f"{number:.4g}{spread} {unit}".rstrip(),
        expected=expected,
        verdict=verdict,
        number=number,
        uncertainty=uncertainty,
        unit=unit,
        advice="" if verdict is Verdict.OK else advice,
    )


class BenchReport(FrozenModel):
    """All findings of a bench check."""

    findings: tuple[Finding, ...]

    @property
    def verdict(self) -> Verdict:
        """Worst verdict of the findings."""
        return max((finding.verdict for finding in self.findings), key=_ORDER.index, default=Verdict.OK)

    def __getitem__(self, name: str) -> Finding:
        """Return the finding ``name``; raises KeyError, whose text lists the existing names."""
        for finding in self.findings:
            if finding.name == name:
                return finding
        raise KeyError(f"no finding {name!r}; found: {', '.join(finding.name for finding in self.findings)}")

    def text(self) -> str:
        """Return the report as a table; advice stands below the line of its finding."""
        rows = [(f.verdict.upper(), f.name, f.value, f.expected) for f in self.findings]
        header = ("", "finding", "measured", "expected")
        widths = [max(len(row[column]) for row in (header, *rows)) for column in range(len(header))]
        lines = [_line(header, widths)]
        for row, finding in zip(rows, self.findings, strict=True):
            lines.append(_line(row, widths))
            if finding.advice:
                lines.append(f"{'':{widths[0]}}  -> {finding.advice}")
        return "\n".join(lines)


def _line(cells: tuple[str, ...], widths: list[int]) -> str:
    return "  ".join(f"{cell:{width}}" for cell, width in zip(cells, widths, strict=True)).rstrip()


_PACE = {"pace", "speed", "faults"}
"""Settings of a virtual rig that may change without a new bench check."""
_HOUR = timedelta(hours=1)
_DAY = timedelta(days=1)


class CheckResult(FrozenModel):
    """Findings of a bench check, with the data needed to decide whether the check is still valid."""

    rig: str
    """Name of the rig that was checked."""
    rig_digest: str
    """SHA-256 of the checked configuration; see `rig_digest`."""
    checked: AwareDatetime
    verdict: Verdict
    findings: tuple[Finding, ...]

    @classmethod
    def of(cls, rig: Rig, report: BenchReport, checked: datetime) -> Self:
        """Return the result to be stored for a report, with the name of the rig and the time of the check."""
        return cls(
            rig=rig.name,
            rig_digest=rig_digest(rig),
            checked=checked,
            verdict=report.verdict,
            findings=report.findings,
        )

    @property
    def report(self) -> BenchReport:
        """The findings of this check as a report."""
        return BenchReport(findings=self.findings)

    def age_h(self, now: datetime) -> float:
        """Return the time since the check [h]."""
        return (now - self.checked) / _HOUR


def rig_digest(rig: Rig) -> str:
    """Return the SHA-256 of a rig's configuration, except settings that may change without a new check."""
    content = rig.model_dump(mode="json", exclude={"check_valid_h": True, "virtual": _PACE})
    return sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def age(age: timedelta) -> str:
    """Return an age as text: ``"3 hours"``, ``"2 days"``."""
    if age < 2 * _HOUR:
        return f"{max(age.total_seconds(), 0.0) / 60:.0f} minutes"
    return f"{age / _HOUR:.0f} hours" if age < 2 * _DAY else f"{age / _DAY:.0f} days"


# Only one program may use a bench. A lock ends with the process that holds it, even if it is killed.
#
# Each instrument has a file in the user's own state folder and one in a folder that all users of the
# computer share. The holder writes its process and user into the file, but only the system's lock counts.
# The file is never removed: otherwise two programs could each lock a file of that name.

_HOLDER = re.compile(rb"\d{1,10} of [\w.-]{1,32}")
"""Pattern of lock-file text that errors may quote; other text is not quoted, as any user may write it."""


class BenchLock:
    """Locks of this process on a rig's instruments; none if the rig is virtual or replays a recording."""

    def __init__(self, descriptors: list[int]) -> None:
        self._descriptors = descriptors

    @classmethod
    def of(cls, rig: Rig) -> "BenchLock":
        """Lock the instruments of a rig, and return the locks.

        Raises InstrumentBusy when another process has locked an instrument, or a lock file cannot be locked.
        """
        lock = cls([])
        if rig.virtual is not None or rig.plays_back:
            return lock
        try:
            for folder in sorted({each.resolve() for each in (state_folder(), shared_folder())}):
                for name in sorted(set(_instruments(rig))):
                    key = sha256(name.encode()).hexdigest()[:16]
                    lock._take(folder / f"vibench-{key}.lock", rig)
        except BaseException:
            lock.close()
            raise
        return lock

    def _take(self, path: Path, rig: Rig) -> None:
        try:
            descriptor = open_for_all(path)
            self._descriptors.append(descriptor)
            is_ours = is_locked_alone(descriptor)
            is_there = os.path.samestat(os.fstat(descriptor), path.stat())
        except OSError as error:
            raise InstrumentBusy(
                f"{rig.name} cannot be marked as in use: the file {path} cannot be locked ({error}). Nothing "
                "was opened; if no measurement is running, ask the owner of the file, or root, to delete it"
            ) from error
        if not (is_ours and is_there):
            raise InstrumentBusy(
                f"{rig.name} is in use by process {_holder(descriptor)}. Nothing was opened; end that "
                "program, or wait until it has ended"
            )
        try:
            os.ftruncate(descriptor, 0)
            write_at(descriptor, f"{os.getpid()} of {getuser()}".encode(), 0)
        except (OSError, KeyError, ImportError):  # another user's file, full disk, nameless user
            return

    def close(self) -> None:
        """Release the locks. May be called at any time."""
        while self._descriptors:
            os.close(self._descriptors.pop())


def _instruments(rig: Rig) -> Iterator[str]:
    """Yield one normalised name for each instrument, so that all spellings of a name share one lock."""
    for resource in (rig.generator.resource, rig.controller.resource if rig.controller else ""):
        if resource:
            yield _plain(resource)
    yield f"{rig.daq.driver} {rig.daq.server} {rig.daq.device}".casefold()


def _plain(resource: str) -> str:
    """Return a VISA name without the optional parts, with all its numbers in decimal form."""
    kind, *others = resource.upper().replace("::LOCALHOST::", "::127.0.0.1::").split("::")
    numbers = [str(int(each, 0)) if re.fullmatch(r"0X[0-9A-F]+", each) else each for each in others]
    return "::".join(
        [re.sub(r"(?<=\D)0$", "", kind), *(each for each in numbers if each not in ("0", "INST0"))]
    )


def _holder(descriptor: int) -> str:
    try:
        found = _HOLDER.match(read_at(descriptor, 64, 0))
    except OSError:
        found = None
    return found[0].decode() if found else "unknown"


def simulated_rig(rig: Rig) -> AbstractContextManager[Any]:
    """Return the virtual rig; the package is loaded only here: a real bench must work without it."""
    made: AbstractContextManager[Any] = import_module("vibench.virtual_rig").VirtualRig(rig)
    return made


class RigPower:
    """Context that keeps a virtual rig switched on, or a real rig's instruments locked.

    The rig's time and its fault script continue while a bench is closed and opened again.
    """

    def __init__(self, rig: Rig) -> None:
        self.rig = rig
        self._virtual: Any = None
        self._closing = ExitStack()

    @property
    def reachable_rig(self) -> Rig:
        """Rig configuration with the current addresses of its instruments."""
        if self._virtual is None:
            return self.rig
        rig, virtual = self.rig, self._virtual
        controller = rig.controller and rig.controller.model_copy(
            update={"resource": virtual.controller_resource}
        )
        return rig.model_copy(
            update={
                "controller": controller,
                "daq": rig.daq.model_copy(update={"server": virtual.daq_address}),
                "generator": rig.generator.model_copy(update={"resource": virtual.visa_resource}),
            }
        )

    @property
    def played_faults(self) -> Sequence[Any]:
        """Faults that a script has injected into the rig so far."""
        return () if self._virtual is None else self._virtual.played_faults

    def aim(self, role: Role) -> None:
        """Move the vibrometer's beam of a virtual rig to the mass of ``role``; do nothing on a real rig."""
        if self._virtual is not None:
            self._virtual.aim(role)

    def let_pass(self, duration_s: float) -> None:
        """Let the time of a virtual rig pass while nothing is sampled; do nothing on a real rig."""
        if self._virtual is not None:
            self._virtual.let_pass(duration_s)

    def idle(self, duration_s: float) -> None:
        """Wait without sampling: in simulated time on a virtual rig at free pace, else in real time."""
        if self._virtual is not None and self.rig.virtual is not None and self.rig.virtual.pace == "free":
            self._virtual.let_pass(duration_s)
        else:
            Alarm().wait(duration_s)

    def __enter__(self) -> Self:
        if self.rig.virtual is not None:
            self._virtual = self._closing.enter_context(simulated_rig(self.rig))
        else:
            self._closing.enter_context(closing(BenchLock.of(self.rig)))
        return self

    def __exit__(self, *_: object) -> None:
        self._virtual = None
        self._closing.close()


class _AimedDigitizer:
    """Digitizer that renames channel ``m0_velocity`` to the role of the mass at which the beam is aimed."""

    def __init__(self, digitizer: Digitizer, role: Role) -> None:
        self._digitizer = digitizer
        self._names = {Role.M0_VELOCITY.value: role.value}

    def __getattr__(self, name: str) -> Any:
        return getattr(self._digitizer, name)

    @property
    def roles(self) -> tuple[str, ...]:
        """Roles of the channels, in the row order of a block of samples."""
        return tuple(self._names.get(each, each) for each in self._digitizer.roles)

    def read(self, samples: int) -> Block:
        """Return the next samples; overloads of the renamed channel are reported under its new role."""
        block = self._digitizer.read(samples)
        named = (
            replace(each, channel=self._names.get(each.channel, each.channel)) for each in block.overloads
        )
        return replace(block, overloads=tuple(named))


class BenchKind(StrEnum):
    """Whether the instruments of a bench are real or simulated."""

    REAL = "real"
    SIMULATED = "simulated"


@dataclass(eq=False, repr=False)
class Bench:
    """A bench: the open instruments of a rig. Use it in a ``with`` block, or `close` it.

    Leaving the block silences generator and analogue output first, then closes everything. An error inside
    the block is raised again; errors that occur while leaving are added to it as notes.
    """

    rig: Rig
    generator: FunctionGenerator
    digitizer: Digitizer
    output: AnalogOutput | None
    controller: RealTimeController | None
    confirmations: KnobSheet
    _power: RigPower
    _closing: ExitStack
    last_check: CheckResult | None = None
    """Bench check that allowed measurements on this bench; see `vibench.acquisition.check`."""

    @property
    def channels(self) -> tuple[Channel, ...]:
        """Recorded channels, in the row order of a block."""
        return channels_of(self.rig)

    @property
    def identities(self) -> dict[str, Identity]:
        """Identities of ``"generator"``, ``"digitizer"``, and, if present, ``"output"``, ``"controller"``."""
        more = {"output": self.output, "controller": self.controller}
        identities = {"generator": self.generator.identity, "digitizer": self.digitizer.identity}
        return identities | {name: each.identity for name, each in more.items() if each is not None}

    @property
    def kind(self) -> BenchKind:
        """Whether the instruments are real or simulated."""
        return _kind(self.rig, self.digitizer)

    @contextmanager
    def beam_on(self, role: Role) -> Iterator["Bench"]:
        """Yield the bench with the beam on the mass of ``role``; a virtual rig's beam returns to m0 at exit.

        Raises ConfigurationError when the vibrometer of this rig cannot measure at that mass.
        """
        aimed = copy(self)
        aimed.rig = self.rig.with_beam_on(role)
        aimed.digitizer = cast("Digitizer", _AimedDigitizer(self.digitizer, role))
        self._power.aim(role)
        try:
            yield aimed
        finally:
            self._power.aim(Role.M0_VELOCITY)

    def idle(self, duration_s: float) -> None:
        """Wait ``duration_s`` without sampling; on a virtual rig at free pace, only simulated time passes."""
        self._power.idle(duration_s)

    def close(self) -> None:
        """Silence generator and output, then close all instruments. May be called at any time."""
        self._closing.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> None:
        _leave(self._closing, error)


def open_bench(
    config: Rig | Path,
    confirm: Confirm | None = None,
    calibration: CalibrationRule | str = CalibrationRule.ENFORCED,
    power: RigPower | None = None,
) -> Bench:
    """Open all instruments of a rig, with generator and analogue output silent, and return the bench.

    Parameters
    ----------
    config
        The rig, or the path of its TOML file. If it has a ``[virtual]`` table, the simulated instruments are
        started, and stopped when the bench is left.
    confirm
        Function that confirms settings made by hand; see `knobs`. If None, ask at the terminal; a virtual rig
        is confirmed without asking.
    calibration
        Whether an expired calibration is refused; calibrations of a virtual rig never expire.
    power
        `RigPower` that stays on when this bench is closed. If None, closing the bench releases the rig.

    Raises
    ------
    ConfigurationError
        When the file contains a value or key that is not allowed.
    CheckFailed
        When a calibration has expired, or when a knob is not confirmed.
    InstrumentBusy
        When another program has this bench open.
    InstrumentError
        When an instrument cannot be opened; the other instruments are then closed again.
    """
    rig = config if isinstance(config, Rig) else load_rig(config)
    has_sensors = rig.virtual is None and not rig.plays_back
    if has_sensors and member(CalibrationRule, calibration) is CalibrationRule.ENFORCED:
        check_calibrations(rig, datetime.now(UTC).astimezone().date())
    closing = ExitStack()
    try:
        return _open_instruments(rig, confirm, power, closing)
    except BaseException as error:
        _leave(closing, error)
        raise


def _open_instruments(rig: Rig, confirm: Confirm | None, power: RigPower | None, closing: ExitStack) -> Bench:
    power = closing.enter_context(RigPower(rig)) if power is None else power
    connected = power.reachable_rig
    # A killed program may have left the output on, so open the generator first: opening it turns it off.
    generator = generator_driver(connected.generator).open(connected.generator)
    with ExitStack() as silencing:
        silencing.callback(generator.close)
        silencing.callback(generator.stop)  # an ExitStack calls its callbacks in reverse order
        simulated = "simulated " if rig.virtual or rig.plays_back else ""
        note_open_bench(simulated + next(_instruments(rig)))  # name the generator: rigs may share a name
        digitizer = digitizer_driver(connected).open(connected)
        closing.callback(digitizer.close)
        output = _output(connected, digitizer, closing)
        controller = _controller(connected, closing)
        # When the bench closes, silence all outputs before any instrument is closed.
        closing.push(silencing.pop_all())
    if output is not None:
        closing.callback(output.stop)
    usual = confirm_simulated if _kind(rig, digitizer) is BenchKind.SIMULATED else confirm_at_terminal
    ask: Callable[..., KnobSheet] = confirm or usual
    sheet = ask((*rig.knobs, *generator.unconfirmed))
    return Bench(rig, generator, digitizer, output, controller, sheet, power, closing)


def _output(rig: Rig, digitizer: Digitizer, closing: ExitStack) -> AnalogOutput | None:
    config, physical = rig.daq.output, rig.daq.output_channel
    if config is None or physical is None:
        return None
    output = output_driver(rig).open(physical, config, digitizer)
    closing.callback(output.close)
    return output


def _controller(rig: Rig, closing: ExitStack) -> RealTimeController | None:
    if rig.controller is None:
        return None
    controller: RealTimeController = plug_in(PlugInKind.DRIVE, "controller").open(rig.controller)
    closing.callback(controller.close)  # opening a generator turns its output off
    return controller


def _kind(rig: Rig, digitizer: Digitizer) -> BenchKind:
    """Return SIMULATED if no hardware can be driven (the rig is virtual or plays a recording), else REAL."""
    is_real = rig.virtual is None and not digitizer.identity.origin
    return BenchKind.REAL if is_real else BenchKind.SIMULATED


def _leave(closing: ExitStack, error: BaseException | None) -> None:
    try:
        closing.close()
    except AcquisitionError as failure:
        if error is None:
            raise
        error.add_note(f"While leaving the bench: {failure}")
        # The context of each failure is the previous failure.
        earlier = failure.__context__
        while earlier is not None and earlier is not error:
            error.add_note(f"While leaving the bench: {earlier}")
            earlier = earlier.__context__


@dataclass(frozen=True)
class InstrumentList:
    """Instruments that a search has found."""

    visa_resources: tuple[str, ...]
    """Names for ``generator.resource``. USB numbers in them may be decimal: 1689::851 is an AFG1022."""
    daq_devices: tuple[FoundDevice, ...]
    remarks: tuple[str, ...]
    """Reasons why a search by VISA or DAQmx failed."""


def list_instruments(visa_library: str = "@py", server: str | None = None) -> InstrumentList:
    """Return the instruments found by VISA and DAQmx; if a search fails, its error becomes a remark.

    Parameters
    ----------
    visa_library
        ``"@py"`` for pyvisa-py, empty for the system's VISA.
    server
        Address of a DAQmx device server, ``"host:port"``; None for the driver on this computer.
    """
    remarks: list[str] = []
    resources: tuple[str, ...] = ()
    devices: tuple[FoundDevice, ...] = ()
    try:
        resources = drivers.list_visa_resources(visa_library)
    except InstrumentError as error:
        remarks.append(str(error))
    try:
        devices = drivers.list_daqmx_devices(server)
    except InstrumentError as error:
        remarks.append(str(error))
    return InstrumentList(resources, devices, tuple(remarks))


def list_rig_instruments(rig: Rig) -> InstrumentList:
    """List the instruments that VISA and DAQmx find for a rig; a virtual rig is started for the search."""
    if rig.virtual is None:
        return list_instruments(rig.generator.visa_library, rig.daq.server)
    with simulated_rig(rig) as virtual:
        return list_instruments(rig.generator.visa_library, virtual.daq_address)
