"""Figs. 3 and 6: Responses I and II at the four amplitudes, of the stops and of the model n = 5."""

from collections.abc import Callable

import numpy as np
from matplotlib.axes import Axes

from vibench.sim import PowerSpring, Specimen, first_order_states, jump_frequencies, spring_of, structure_of
from vibench.sim.study import Study, StudyResults

from ..figures import MEASURED, PREDICTED, SIMULATED, TERMINAL, DrawnFigure, legend_above, new_figure, styled
from ..signals import Reals
from ..tables import Table, table
from ._options import AMPLITUDES_M, CASES, FigureOptions
from ._responses import Responses, draw_linear, finish, responses, shade, specimen_of

_CONTINUOUS = "power:5"
_BALANCE_STEP_HZ = 1.0


def levels_study(options: FigureOptions, model: str = "hertz") -> Study:
    """One model at the paper's four amplitudes."""
    return Study(
        models=(model,),
        amplitudes_m=AMPLITUDES_M,
        gaps_m=(options.gap_m,),
        damping_times_s=(options.damping_time_s,),
        frequencies_hz=options.frequencies_hz,
        accuracy=options.accuracy,
        duration_s=options.duration_s,
        window_s=options.window_s,
        budget_s=options.budget_s,
    )


def continuous_study(options: FigureOptions) -> Study:
    """Study the continuous model n = 5 of Fig. 6."""
    return levels_study(options, _CONTINUOUS)


def levels_figure(options: FigureOptions, results: StudyResults) -> DrawnFigure:
    """Draw Fig. 3: the piece-wise model, colliding frequencies shaded."""
    specimen = specimen_of(results.study, "hertz", options)

    def draw(axes: Axes, curve: Responses, _amplitude_m: float) -> None:
        shade(axes, curve.frequency_hz, curve.collides, "m1 and m2 collide")
        draw_linear(axes, curve.frequency_hz, specimen)

    return _four_panels(
        "figure_3",
        "Figure 3: Responses I and II of the piece-wise model",
        f"Grey: frequencies at which m1 and m2 collided within the window. {options.sentence}",
        results,
        draw,
    )


def continuous_figure(options: FigureOptions, results: StudyResults) -> DrawnFigure:
    """Draw Fig. 6: the continuous model n = 5, first-order harmonic balance over integration."""
    specimen = specimen_of(results.study, _CONTINUOUS, options)

    def draw(axes: Axes, curve: Responses, amplitude_m: float) -> None:
        low, high = float(curve.frequency_hz[0]), float(curve.frequency_hz[-1])
        frequency_hz, size = _balanced(specimen, amplitude_m, low, high)
        axes.plot(
            frequency_hz,
            size,
            color=PREDICTED,
            linestyle="none",
            marker=".",
            markersize=2,
            label="harmonic balance (first order)",
        )
        spring = spring_of(specimen)
        assert isinstance(spring, PowerSpring)
        for number, at_hz in enumerate(
            jump_frequencies(structure_of(specimen), spring, amplitude_m, low, high)
        ):
            named = "fold: a jump" if number == 0 else None
            axes.axvline(float(at_hz), color=TERMINAL, linestyle=":", linewidth=0.8, label=named)

    return _four_panels(
        "figure_6",
        "Figure 6: Responses I and II of the continuous model, n = 5",
        "Blue: all solutions of the paper's first-order balance; dotted: where they fold. "
        + options.sentence,
        results,
        draw,
    )


def _balanced(specimen: Specimen, amplitude_m: float, low: float, high: float) -> tuple[Reals, Reals]:
    """Give every first-order solution |x| / A0 on a grid of 1 Hz."""
    structure, spring = structure_of(specimen), spring_of(specimen)
    assert isinstance(spring, PowerSpring)
    found = [
        (frequency_hz, abs(state.displacements[0]) / amplitude_m)
        for frequency_hz in np.arange(low, high + 0.5 * _BALANCE_STEP_HZ, _BALANCE_STEP_HZ)
        for state in first_order_states(structure, spring, float(frequency_hz), amplitude_m)
    ]
    frequency_hz, size = np.array(found).T
    return frequency_hz, size


def _four_panels(
    name: str,
    title: str,
    said: str,
    results: StudyResults,
    draw: Callable[[Axes, Responses, float], None],
) -> DrawnFigure:
    tables: list[Table] = []
    with styled():
        figure = new_figure(6.6)
        panels = figure.subplots(2, 2, sharex=True, sharey=True)
        for axes, amplitude_m, case in zip(panels.ravel(), AMPLITUDES_M, CASES, strict=True):
            curve = responses(results, amplitude=amplitude_m)
            draw(axes, curve, amplitude_m)
            axes.plot(curve.frequency_hz, curve.response_i, color=MEASURED, label="Response I")
            axes.plot(
                curve.frequency_hz, curve.response_ii, color=SIMULATED, linestyle="-.", label="Response II"
            )
            finish(axes, curve.frequency_hz, "response of m0 over A0")
            axes.set_title(f"{case}: A0 = {1e6 * amplitude_m:g} µm")
            tables.append(_table(name, amplitude_m, curve))
        for axes in panels[1]:
            axes.set_xlabel("drive frequency [Hz]")
        for axes in panels[:, 1]:
            axes.set_ylabel("")
        legend_above(figure, list(panels.ravel()))
    return DrawnFigure(name, title, said, figure, tuple(tables))


def _table(name: str, amplitude_m: float, curve: Responses) -> Table:
    return table(
        f"{name}_{1e6 * amplitude_m:g}um",
        frequency_hz=curve.frequency_hz,
        response_i=curve.response_i,
        response_ii=curve.response_ii,
        collides=curve.collides.astype(np.int64),
    )
