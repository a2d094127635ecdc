"""The bench: all instruments of a rig, opened together or not at all, and left with the generator silent."""

from collections.abc import Callable
from contextlib import ExitStack
from datetime import UTC, datetime
from enum import StrEnum
from pathlib import Path
from types import TracebackType
from typing import Self

from ..errors import AcquisitionError
from ..host.chosen import chosen
from ..instruments import AnalogOutput, Digitizer, FunctionGenerator, Identity, RealTimeController
from ..rig import (
    CalibrationRule,
    Channel,
    Confirm,
    KnobSheet,
    Rig,
    channels_of,
    check_calibrations,
    confirm_at_terminal,
    confirm_simulated,
    controller_driver,
    digitizer_driver,
    generator_driver,
    load_rig,
    output_driver,
)
from .result import CheckResult
from .rig_power import RigPower


class BenchKind(StrEnum):
    """Whether the numbers of a bench come from the world or from a calculation."""

    REAL = "real"
    SIMULATED = "simulated"


class Bench:
    """The open instruments of a rig. Use it in a ``with``, or `close` it.

    Leaving silences generator and analogue output first, then closes everything, whatever happened; an
    error that is under way stays in front, and what fails while leaving becomes a note on it.
    """

    def __init__(
        self,
        rig: Rig,
        generator: FunctionGenerator,
        digitizer: Digitizer,
        output: AnalogOutput | None,
        controller: RealTimeController | None,
        confirmations: KnobSheet,
        power: RigPower,
        closing: ExitStack,
    ) -> None:
        self.rig = rig
        self.generator = generator
        self.digitizer = digitizer
        self.output = output
        self.controller = controller
        self.confirmations = confirmations
        self.last_check: CheckResult | None = None
        """The check that this bench was admitted on; see `vibench.acquisition.check`."""
        self._power = power
        self._closing = closing

    @property
    def channels(self) -> tuple[Channel, ...]:
        """What is recorded, in the order of the rows of a block."""
        return channels_of(self.rig)

    @property
    def identities(self) -> dict[str, Identity]:
        """Who answered: ``"generator"``, ``"digitizer"``, and ``"output"``, ``"controller"`` if any."""
        more = {"output": self.output, "controller": self.controller}
        identities = {"generator": self.generator.identity, "digitizer": self.digitizer.identity}
        return identities | {name: each.identity for name, each in more.items() if each is not None}

    @property
    def kind(self) -> BenchKind:
        """Whether the instruments are simulated."""
        return _kind(self.rig, self.digitizer)

    def idle(self, duration_s: float) -> None:
        """Wait while nothing is sampled [s]; a virtual rig at its own pace lets its own time pass."""
        self._power.idle(duration_s)

    def close(self) -> None:
        """Silence everything that plays, then close everything. Legal at any time."""
        self._closing.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        _leave(self._closing, error)


def open_bench(
    config: Rig | Path,
    confirm: Confirm | None = None,
    calibration: CalibrationRule | str = CalibrationRule.ENFORCED,
    power: RigPower | None = None,
) -> Bench:
    """Open every instrument of a rig, with generator and analogue output silent.

    Parameters
    ----------
    config
        The rig, or the path of its TOML file. With a ``[virtual]`` table the simulated instruments
        are started as well, and stopped when the bench is left.
    confirm
        How settings made by hand are confirmed; see `knobs`. Absent: at the terminal, and for a
        virtual rig without asking.
    calibration
        What a calibration that has run out does; a virtual rig's never runs out.
    power
        What holds the rig beyond this bench; absent, it is let go with it.

    Raises
    ------
    ConfigurationError
        When the file says something that is not allowed.
    CheckFailed
        When a calibration has run out, or a knob is not confirmed.
    InstrumentBusy
        When another program has this bench open.
    InstrumentError
        When an instrument cannot be opened; the others are then closed again.

    """
    rig = config if isinstance(config, Rig) else load_rig(config)
    has_sensors = rig.virtual is None and not rig.plays_back
    if has_sensors and chosen(CalibrationRule, calibration) is CalibrationRule.ENFORCED:
        check_calibrations(rig, datetime.now(UTC).astimezone().date())
    closing = ExitStack()
    try:
        return _opened(rig, confirm, power, closing)
    except BaseException as error:
        _leave(closing, error)
        raise


def _opened(rig: Rig, confirm: Confirm | None, power: RigPower | None, closing: ExitStack) -> Bench:
    power = closing.enter_context(RigPower(rig)) if power is None else power
    connected = power.connected
    digitizer = digitizer_driver(connected).open(connected)
    closing.callback(digitizer.close)
    output = _output(connected, digitizer, closing)
    controller = _controller(connected, closing)
    generator = generator_driver(connected.generator).open(connected.generator)
    closing.callback(generator.close)
    closing.callback(generator.stop)  # the last to enter is the first to happen
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
    controller = controller_driver(rig.controller).open(rig.controller)
    closing.callback(controller.close)  # silences it
    return controller


def _kind(rig: Rig, digitizer: Digitizer) -> BenchKind:
    """Real, unless all is simulated or a recording is played back: nothing can then be energised."""
    is_real = rig.virtual is None and not digitizer.identity.origin
    return BenchKind.REAL if is_real else BenchKind.SIMULATED


def _leave(closing: ExitStack, error: BaseException | None) -> None:
    try:
        closing.close()
    except AcquisitionError as failure:
        if error is None:
            raise
        error.add_note(f"While leaving the bench: {failure}")
        # One failure after another: each carries the one before it.
        earlier = failure.__context__
        while earlier is not None and earlier is not error:
            error.add_note(f"While leaving the bench: {earlier}")
            earlier = earlier.__context__
