"""Request for a chain: its cells, their number, and the drive."""

from collections.abc import Sequence
from enum import StrEnum
from functools import cached_property
from itertools import cycle, islice
from pathlib import Path
from typing import Annotated, Self

from pydantic import Field, NonNegativeFloat, PositiveFloat, model_validator

from vibench.sim import Accuracy, Harmonic, SpecimenTable, count_text
from vibench.sim.chain import MOST_CELLS, Chain
from vibench.sim.study import TargetError, TargetTime, frequency_range

from ._specimen_choice import SpecimenChoice

MOST_RUNS = 20_000


class ChainDrive(StrEnum):
    """Motion of the base of a chain."""

    NONE = "none"
    """No motion: only bands, gaps and transmissibility without contact."""
    STEADY = "steady"
    """A steady sine at each frequency, starting from rest."""
    SWEPT = "swept"
    """A linear sine sweep, up or down."""
    RECORDED = "recorded"
    """The base motion of a recording."""


class ChainRequest(SpecimenChoice):
    """A chain under one kind of drive; the unit consists of the specimen and any `others`."""

    others: tuple[SpecimenTable, ...] = ()
    """Further specimens in the unit of the chain, after the first."""
    lengths: Annotated[tuple[Annotated[int, Field(ge=1, le=MOST_CELLS)], ...], Field(min_length=1)] = (8,)
    """Number of cells; give several numbers to study chains of different lengths."""
    drive: ChainDrive = ChainDrive.STEADY
    """Drive of the base: none, a steady sine, a sweep, or a recorded motion."""
    amplitude_m: PositiveFloat = 20e-6
    """Amplitude of the base displacement of steady sines or a sweep."""
    start_hz: PositiveFloat = 220.0
    """First frequency of steady sines or a sweep."""
    stop_hz: PositiveFloat = 220.0
    """Last frequency of steady sines or a sweep; below the first for a downward sweep."""
    step_hz: PositiveFloat = 10.0
    """Step between the frequencies of steady sines."""
    recording: str = ""
    """Path of the recording whose base motion drives the chain."""
    duration_s: PositiveFloat = 2.0
    """Observation time under a steady sine, length of a sweep, or maximum length of a recording."""
    settle_s: NonNegativeFloat = 2.0
    """Settling time from rest under a steady sine, before the observation."""
    exponent_s: NonNegativeFloat = 0.0
    """Averaging time of the largest Lyapunov exponent under a steady sine; 0 for none."""
    accuracy: Accuracy = Accuracy.STANDARD
    """Accuracy of contacts; flight is exact at every accuracy."""
    error: TargetError | None = None
    """Requested relative error of transmissions under a steady sine, such as 0.01 or "1 %"; determines the
    accuracy and the times."""
    time_s: TargetTime | None = None
    """Computing time of each run under a steady sine, such as 2 or "2 s"; one minute by default."""

    @model_validator(mode="after")
    def _is_possible(self) -> Self:
        self.chain(max(self.lengths))
        Harmonic(self.start_hz, self.amplitude_m)  # raises an error if the drive is impossible
        self._refuse_beside_target()
        if self.drive is ChainDrive.STEADY and self.start_hz > self.stop_hz:
            raise ValueError(
                f"the range {self.start_hz:g} to {self.stop_hz:g} Hz does not ascend; give the lower "
                "frequency first, or choose a swept drive"
            )
        if self.drive is ChainDrive.STEADY and len(self.frequencies_hz) * len(self.lengths) > MOST_RUNS:
            raise ValueError(f"more than {MOST_RUNS} runs were requested; take a larger step")
        if self.drive is ChainDrive.SWEPT and self.start_hz == self.stop_hz:
            raise ValueError(
                f"a sweep from {self.start_hz:g} to {self.stop_hz:g} Hz has no range; give two different "
                "frequencies, or choose a steady drive"
            )
        if self.drive is ChainDrive.RECORDED and not self.recording:
            raise ValueError("no recording was given to drive the chain; give its path")
        return self

    @property
    def has_target(self) -> bool:
        """Return whether an error or a computing time was requested."""
        return self.error is not None or self.time_s is not None

    def _refuse_beside_target(self) -> None:
        """Refuse unsteady drives, and options that follow from a requested error or time, if one is given."""
        if not self.has_target:
            return
        if self.drive is not ChainDrive.STEADY:
            raise ValueError(f"an error or time needs a steady drive, not {self.drive}; leave it out")
        for name in ("accuracy", "duration_s", "settle_s"):
            if getattr(self, name) != type(self).model_fields[name].default:
                raise ValueError(f"{name} was given, but the error or time determines it; leave {name} out")

    @cached_property
    def unit(self) -> Chain:
        """Smallest repeating part of the chain: the specimen and any `others`."""
        changed = self.model.strip() or None, self.damping_time_s, self.gap_m
        return Chain((self.chosen_specimen, *(each.specimen(*changed) for each in self.others)))

    def chain(self, cells: int) -> Chain:
        """Build a chain with this number of cells by repeating the unit."""
        return Chain(tuple(islice(cycle(self.unit.cells), cells)))

    @property
    def frequencies_hz(self) -> Sequence[float]:
        """Frequencies of a steady sine, ascending."""
        is_one = self.start_hz == self.stop_hz
        return (self.start_hz,) if is_one else frequency_range(self.start_hz, self.stop_hz, self.step_hz)

    @property
    def title(self) -> str:
        """Title of the chain request for figures."""
        cells = ", ".join([*map(str, self.lengths[:-1]), count_text(self.lengths[-1], "cell")])
        match self.drive:
            case ChainDrive.NONE:
                return f"{cells} without contact"
            case ChainDrive.RECORDED:
                return f"{cells}, base of {Path(self.recording).name}"
            case _:
                many = self.start_hz != self.stop_hz
                where = f"{self.start_hz:g} to {self.stop_hz:g} Hz" if many else f"{self.start_hz:g} Hz"
                return f"{cells}, {where}, {1e6 * self.amplitude_m:g} µm, {self.drive.value}"

    @property
    def sentence(self) -> str:
        """Return the caption of a figure, with all options."""
        names = ", ".join([self.specimen_text, *(each.name for each in self.others)])
        times = {
            ChainDrive.NONE: "",
            ChainDrive.STEADY: f", {self.duration_s:g} s after {self.settle_s:g} s of settling"
            if not self.has_target
            else "",
            ChainDrive.SWEPT: f", {self.duration_s:g} s long",
            ChainDrive.RECORDED: f", {self.duration_s:g} s at most",
        }[self.drive]
        return f"{self.title}; {names}, {self.accuracy.value} accuracy{times}."
