"""The figures of the paper, and functions that draw in several of them."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from vibench.analysis import report
from vibench.sim import Specimen
from vibench.sim.study import Study, StudyResults

from .options import Case
from .responses import Flags, Reals, Responses, linear_transmissibility

if TYPE_CHECKING:
    from matplotlib.axes import Axes

GREY = "#9a9a9a"
RESPONSES = {"response_i": "Response I", "response_ii": "Response II"}
"""Names of the columns and of the curves."""
Drawn = tuple[str, Mapping[str, Mapping[str, Reals]]]
"""Caption of a figure without its options, and the columns of each table by the end of the table's name."""


def shade(axes: "Axes", frequency_hz: Reals, flags: Flags, label: str) -> None:
    """Shade each flagged frequency, up to the midpoints between this frequency and its neighbours."""
    between = 0.5 * (frequency_hz[1:] + frequency_hz[:-1])
    edges = np.concatenate(([frequency_hz[0]], between, [frequency_hz[-1]]))
    changes = np.flatnonzero(np.diff(flags, prepend=False, append=False))
    for first, end in changes.reshape(-1, 2):
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
    """Set the axes of a response panel; in a grid of panels, remove the inner labels with `label_outer`."""
    report.frequency_axis(axes, float(max(frequency_hz[0], 10.0)), float(frequency_hz[-1]))
    report.magnitude_axis(axes)
    axes.set(ylabel=label, xlabel="drive frequency [Hz]")


def model_label(model: str) -> str:
    """Return a model's name for a legend, such as n = 5."""
    return "piece-wise" if model == "hertz" else f"n = {model.removeprefix('power:')}"


def model_name(model: str) -> str:
    """Return a model's name for the heading of a column, such as power_3_5_7."""
    return model.replace(":", "_").replace("+", "_")


def draw_terminal(axes: "Axes", specimen: Specimen) -> None:
    """Mark the terminal resonances by dotted lines."""
    for bound_hz in specimen.bound_frequencies_hz:
        axes.axvline(float(bound_hz), color=report.TERMINAL, linestyle=":", linewidth=1.0)


@dataclass(frozen=True)
class PaperFigure:
    """A simulated figure of the paper."""

    number: str
    subject: str
    height_in: float
    studies: Callable[[Case], tuple[Study, ...]]
    draw_in: Callable[..., Drawn]
    """Function that draws in an empty figure, from the options and the results of each study."""

    def draw(self, options: Case, *results: StudyResults) -> report.DrawnFigure:
        """Draw the figure from the results of its studies."""
        name = f"figure_{self.number.replace(' ', '')}"
        with report.figure_style():
            figure = report.new_figure(self.height_in)
            caption, tables = self.draw_in(figure, options, *results)
        return report.DrawnFigure(
            name=name,
            title=f"Figure {self.number}: {self.subject}",
            caption=f"{caption} {options.sentence}" if results else caption,
            figure=figure,
            tables=tuple(report.table(f"{name}{end}", **columns) for end, columns in tables.items()),
        )


def paper_figure(
    number: str,
    subject: str,
    height_in: float,
    studies: Callable[[Case], tuple[Study, ...]] = lambda _: (),
) -> Callable[[Callable[..., Drawn]], PaperFigure]:
    """Return a decorator for a function that draws a figure from the results of these studies."""
    return partial(PaperFigure, number, subject, height_in, studies)
