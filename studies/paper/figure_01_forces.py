"""Fig. 1 c: the force of the stops, and the forces of the continuous models fitted to it."""

import numpy as np

from vibench.analysis import report
from vibench.sim import gong2025, spring_of
from vibench.sim.study import Study

from .options import FigureOptions

_MODELS = ("power:3", "power:5", "power:7", "power:3+5+7", "power:47")
_REACH = 48.0 / 45.0
"""Largest displacement shown, relative to the gap."""
_HIGHEST = 1.5
"""Largest force shown, relative to the largest contact force."""


def studies(_: FigureOptions) -> tuple[Study, ...]:
    """Return no studies, because forces need none."""
    return ()


def draw(options: FigureOptions) -> report.DrawnFigure:
    """Draw force over relative displacement for all models."""
    p = np.linspace(0.0, _REACH * options.gap_m, 481)
    forces = {
        model: spring_of(gong2025(options.damping_time_s, options.gap_m, model)).force(p, np.zeros_like(p))
        for model in ("hertz", *_MODELS)
    }
    with report.figure_style():
        figure = report.new_figure(3.4)
        axes = figure.subplots()
        axes.plot(1e6 * p, forces["hertz"], color=report.MEASURED, linewidth=1.8, label="Hertz stops")
        axes.set_prop_cycle(color=report.LEVELS, linestyle=report.LEVEL_STYLES)
        for model in _MODELS:
            axes.plot(1e6 * p, forces[model], label=f"n = {model.removeprefix('power:')}")
        axes.axvline(1e6 * options.gap_m, color="#9a9a9a", linewidth=0.8)
        axes.set(
            ylim=(0, _HIGHEST * float(forces["hertz"].max())),
            xlim=(0, 1e6 * float(p[-1])),
            xlabel="relative displacement p [µm]",
            ylabel="force between m1 and m2 [N]",
        )
        report.legend_above(figure, [axes])
    columns = {f"force_{model.replace(':', '_').replace('+', '_')}_n": forces[model] for model in forces}
    return report.DrawnFigure(
        name="figure_1c",
        title="Figure 1 c: forces of the models",
        caption=(
            f"Force of the stops (gap {1e6 * options.gap_m:g} µm, grey line) and of the continuous models, "
            "which have the same force 1 µm beyond the gap. The terms of the sum 3+5+7 have equal shares of "
            "this force, because the paper gives no shares."
        ),
        figure=figure,
        tables=(report.table("figure_1c", relative_displacement_m=p, **columns),),
    )
