"""Response curves out of a study, and how they are drawn in every figure of the paper."""

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from vibench.analysis.report import COLLIDING, LINEAR, frequency_axis, magnitude_axis
from vibench.sim import Harmonic, Specimen, base_transmissibility
from vibench.sim.study import StudyResults

Reals = NDArray[np.float64]
Flags = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Responses:
    """One model at one amplitude; arrays of shape (points,)."""

    frequency_hz: Reals
    response_i: Reals
    response_ii: Reals
    relative_i: Reals
    exponent_per_s: Reals
    """NaN where none was asked for."""
    collides: Flags
    """Where m1 and m2 struck each other within the window."""


def responses(results: StudyResults, **fixed: float | str) -> Responses:
    """Read one curve of a study; every axis but frequency is fixed, or has one value."""
    only = {axis.name: axis.values[0] for axis in results.axes if len(axis.values) == 1}
    at = {name: value for name, value in {**only, **fixed}.items() if name != "frequency"}
    impacts = results.values("impacts", **at)
    return Responses(
        frequency_hz=np.asarray(results.study.frequencies_hz),
        response_i=results.values("response_i", **at),
        response_ii=results.values("response_ii", **at),
        relative_i=results.values("relative_i", **at),
        exponent_per_s=results.values("lyapunov", **at),
        collides=np.asarray(np.nan_to_num(impacts) > 0),
    )


def drive_at(frequency_hz: float, amplitude_m: float) -> Harmonic:
    """U = A0 sin(omega t), as in the paper."""
    return Harmonic(frequency_hz, amplitude_m)


def shade(axes: Axes, frequency_hz: Reals, flags: Flags, label: str | None = None) -> None:
    """Shade the frequencies that are flagged, each to halfway to its neighbours."""
    if not flags.any():
        return
    between = 0.5 * (frequency_hz[1:] + frequency_hz[:-1])
    edges = np.concatenate(([frequency_hz[0]], between, [frequency_hz[-1]]))
    changes = np.flatnonzero(np.diff(np.concatenate(([False], flags, [False])).astype(np.int8)))
    for number, (first, last) in enumerate(changes.reshape(-1, 2)):
        named = label if number == 0 else None
        axes.axvspan(edges[first], edges[last], color=COLLIDING, zorder=0, linewidth=0, label=named)


def linear_transmissibility(specimen: Specimen, frequency_hz: Reals) -> Reals:
    """Return |x / U| of the specimen without contact, shape (frequencies,)."""
    return np.abs(base_transmissibility(specimen, frequency_hz)[:, 0])


def draw_linear(axes: Axes, frequency_hz: Reals, specimen: Specimen) -> None:
    """Draw the response without contact, on a grid of its own that shows its peaks."""
    fine = np.linspace(frequency_hz[0], frequency_hz[-1], 4 * frequency_hz.size)
    axes.plot(
        fine,
        linear_transmissibility(specimen, fine),
        color=LINEAR,
        linestyle="--",
        linewidth=1.0,
        label="without contact",
    )


def finish(axes: Axes, frequency_hz: Reals, label: str) -> None:
    """Give a response panel its axes."""
    frequency_axis(axes, float(max(frequency_hz[0], 10.0)), float(frequency_hz[-1]))
    magnitude_axis(axes)
    axes.set_ylabel(label)
