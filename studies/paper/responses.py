"""Response curves from a study, and functions to draw them."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from vibench.analysis import report
from vibench.sim import Specimen, base_transmissibility
from vibench.sim.study import StudyResults

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Reals = NDArray[np.float64]
Flags = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Responses:
    """Curve of one model at one amplitude; arrays of shape (points,)."""

    frequency_hz: Reals
    response_i: Reals
    response_ii: Reals
    relative_i: Reals
    exponent_per_s: Reals
    """Largest Lyapunov exponent [1/s]; NaN if not computed."""
    collides: Flags
    """Whether m1 and m2 collided within the window."""

    def columns(self, *names: str) -> dict[str, Reals]:
        """Return columns of a table: the frequencies and these quantities; flags become 0 and 1."""
        return {name: getattr(self, name) + 0 for name in ("frequency_hz", *names)}


def responses(results: StudyResults, **fixed: float | str) -> Responses:
    """Return one curve of a study; each axis except frequency must be fixed or have one value."""
    only = {axis.name: axis.values[0] for axis in results.axes if len(axis.values) == 1}
    at = {name: value for name, value in {**only, **fixed}.items() if name != "frequency"}
    return Responses(
        frequency_hz=np.asarray(results.study.frequencies_hz),
        response_i=results.values("response_i", **at),
        response_ii=results.values("response_ii", **at),
        relative_i=results.values("relative_i", **at),
        exponent_per_s=results.values("lyapunov", **at),
        collides=np.asarray(np.nan_to_num(results.values("impacts", **at)) > 0),
    )


def linear_transmissibility(specimen: Specimen, frequency_hz: Reals) -> Reals:
    """Return |x / U| of the specimen without contact, shape (frequencies,)."""
    return np.abs(base_transmissibility(specimen, frequency_hz)[:, 0])


def stretches(flags: Flags) -> NDArray[np.intp]:
    """Return the first index of each run of true flags, and the first index after it, shape (runs, 2)."""
    changes = np.diff(np.concatenate(([False], flags, [False])).astype(np.int8))
    return np.flatnonzero(changes).reshape(-1, 2)


def shade(axes: "Axes", frequency_hz: Reals, flags: Flags, label: str) -> None:
    """Shade each flagged frequency, as far as the midpoints between it and its neighbours."""
    between = 0.5 * (frequency_hz[1:] + frequency_hz[:-1])
    edges = np.concatenate(([frequency_hz[0]], between, [frequency_hz[-1]]))
    for first, end in stretches(flags):
        axes.axvspan(edges[first], edges[end], color=report.COLLIDING, zorder=0, linewidth=0, label=label)


def draw_linear(axes: "Axes", frequency_hz: Reals, specimen: Specimen) -> None:
    """Draw the response without contact, on a grid fine enough for its peaks."""
    fine = np.linspace(frequency_hz[0], frequency_hz[-1], 4 * frequency_hz.size)
    linear = linear_transmissibility(specimen, fine)
    axes.plot(fine, linear, color=report.LINEAR, linestyle="--", linewidth=1.0, label="without contact")


def draw_responses(axes: "Axes", curve: Responses) -> None:
    """Draw Responses I and II."""
    f = curve.frequency_hz
    axes.plot(f, curve.response_i, color=report.MEASURED, label="Response I")
    axes.plot(f, curve.response_ii, color=report.SIMULATED, linestyle="-.", label="Response II")
    finish(axes, f, "response of m0 over A0")


def finish(axes: "Axes", frequency_hz: Reals, label: str) -> None:
    """Set the axes of a response panel; in a grid of panels, `label_outer` then removes the inner labels."""
    report.frequency_axis(axes, float(max(frequency_hz[0], 10.0)), float(frequency_hz[-1]))
    report.magnitude_axis(axes)
    axes.set(ylabel=label, xlabel="drive frequency [Hz]")
