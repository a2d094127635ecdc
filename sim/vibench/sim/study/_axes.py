"""What varies in a study: named axes with their values, units and labels, in the order of the file."""

from dataclasses import dataclass

from ._grid import Grid

FREQUENCY = "frequency"
START = "start"
MODEL = "model"


@dataclass(frozen=True)
class Axis:
    """One dimension of a study's arrays."""

    name: str
    values: tuple[float | str, ...]
    """Numbers ascending, or labels."""
    units: str
    """UDUNITS text; empty for labels."""
    long_name: str

    @property
    def is_ordered(self) -> bool:
        """Whether it holds numbers, whose neighbours are like each other."""
        return bool(self.units)


def grid_of(axes: tuple[Axis, ...]) -> Grid:
    """Grid over these axes, the last one running fastest."""
    return Grid(tuple(len(axis.values) for axis in axes), tuple(axis.is_ordered for axis in axes))
