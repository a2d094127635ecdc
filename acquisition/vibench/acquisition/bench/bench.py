"""Bench: all instruments of a rig, opened together or not at all; closing it silences the generator."""

import os
import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, ExitStack, closing, contextmanager
from copy import copy
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from enum import StrEnum
from getpass import getuser
from hashlib import sha256
from importlib import import_module
from pathlib import Path
from threading import Event as Alarm
from typing import Any, Self, cast

from vibench.sim.operating_system.this import (
    is_locked_alone,
    open_for_all,
    read_at,
    shared_folder,
    state_folder,
    write_at,
)

from ..errors import AcquisitionError, InstrumentBusy
from ..host.chosen import member
from ..instruments import (
    AnalogOutput,
    Block,
    Digitizer,
    FunctionGenerator,
    Identity,
    PlugInKind,
    RealTimeController,
    plug_in,
)
from ..rig import (
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
from ..stopping.program import note_open_bench
from .result import CheckResult

# Only one program may use a bench. A lock ends with the process that holds it, even if it is killed.
#
# Each instrument has a file in the user's own state folder and one in a folder that all users of the
# computer share. The holder writes its process and user into the file, but only the system's lock counts.
# The file is never removed: otherwise two programs could each lock a file of that name.

_HOLDER = re.compile(rb"\d{1,10} of [\w.-]{1,32}")
"""Text of a lock file that errors may quote; other text is not quoted, as any user may write to the file."""


class BenchLock:
    """Locks of this process on a rig's instruments; no locks if the rig is virtual or replays a recording."""

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
                "was opened; if no measurement runs, have the file's owner or root delete it"
            ) from error
        if not (is_ours and is_there):
            raise InstrumentBusy(
                f"{rig.name} is in use by process {_holder(descriptor)}. Nothing was opened; end that "
                "program, or wait until it has ended"
            )
        try:
            os.ftruncate(descriptor, 0)
            write_at(descriptor, f"{os.getpid()} of {getuser()}".encode(), 0)
        except (OSError, KeyError, ImportError):  # file of another user, full disk, unnamed user
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
    """Return a VISA name without its optional parts, and with its numbers in decimal form."""
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
    """Return the virtual rig; its package is loaded only here, as a real bench must work without it."""
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
        The rig, or the path of its TOML file. With a ``[virtual]`` table the simulated instruments
        are started as well, and stopped when the bench is left.
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
        When a calibration has expired, or a knob is not confirmed.
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
    # Open the generator first, which silences it: a killed program may have left its output on.
    generator = generator_driver(connected.generator).open(connected.generator)
    with ExitStack() as silencing:
        silencing.callback(generator.close)
        silencing.callback(generator.stop)  # an ExitStack calls its callbacks in reverse order
        simulated = "simulated " if rig.virtual or rig.plays_back else ""
        note_open_bench(simulated + next(_instruments(rig)))  # the generator, as rigs may share a name
        digitizer = digitizer_driver(connected).open(connected)
        closing.callback(digitizer.close)
        output = _output(connected, digitizer, closing)
        controller = _controller(connected, closing)
        # At the end, silence the outputs first, then close all instruments.
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
    closing.callback(controller.close)  # opening a generator silences it
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
        # The context of each failure is the failure before it.
        earlier = failure.__context__
        while earlier is not None and earlier is not error:
            error.add_note(f"While leaving the bench: {earlier}")
            earlier = earlier.__context__
