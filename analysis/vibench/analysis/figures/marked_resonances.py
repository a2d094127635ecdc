"""Vertical lines where the model has its resonances, with and without contact."""

from collections.abc import Sequence
from dataclasses import dataclass

from matplotlib.axes import Axes

from vibench.sim import Specimen

from .style import BOUNDS, TERMINAL

_LABEL_HEIGHT = 1.01
"""Just above the axis, in parts of its height."""
_FREE_LABEL = "resonances without contact"
_BOUND_LABEL = "terminal resonances (m1 stuck to m2)"


@dataclass(frozen=True)
class ModelResonances:
    """Where the model has its resonances [Hz]."""

    free_hz: tuple[float, ...]
    bound_hz: tuple[float, ...]


def model_resonances(specimen: Specimen) -> ModelResonances:
    """Give the undamped natural frequencies with and without contact."""
    return ModelResonances(
        tuple(float(each) for each in specimen.natural_frequencies_hz),
        tuple(float(each) for each in specimen.bound_frequencies_hz),
    )


def mark_resonances(axes: Axes, at: ModelResonances) -> None:
    """Draw dashed lines without contact and dotted ones with m1 stuck to m2."""
    for number, frequency in enumerate(at.free_hz):
        label = _FREE_LABEL if number == 0 else None
        axes.axvline(frequency, color=BOUNDS, linestyle="--", linewidth=0.8, label=label, zorder=1)
    for number, frequency in enumerate(at.bound_hz):
        label = _BOUND_LABEL if number == 0 else None
        axes.axvline(frequency, color=TERMINAL, linestyle=":", linewidth=1.0, label=label, zorder=1)


def label_resonances(axes: Axes, at: ModelResonances) -> None:
    """Write the frequencies above the axis."""
    _write(axes, at.free_hz, "#555555")
    _write(axes, at.bound_hz, TERMINAL)


def _write(axes: Axes, frequencies_hz: Sequence[float], colour: str) -> None:
    low, high = axes.get_xlim()
    for frequency in frequencies_hz:
        if low <= frequency <= high:
            axes.text(
                frequency,
                _LABEL_HEIGHT,
                f"{frequency:.0f}",
                transform=axes.get_xaxis_transform(),
                ha="center",
                va="bottom",
                fontsize=7,
                color=colour,
            )
