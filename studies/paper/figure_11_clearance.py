"""Fig. 11: the gap at equal amplitude: whatever it is, two resonances remain."""

from vibench.analysis.report import (
    LEVEL_STYLES,
    LEVELS,
    TERMINAL,
    DrawnFigure,
    legend_above,
    new_figure,
    styled,
    table,
)
from vibench.sim.study import Study, StudyResults

from .options import FigureOptions
from .responses import finish, responses

GAPS_M = (5e-6, 15e-6, 30e-6, 45e-6, 60e-6)
"""The text copy of the paper does not name its gaps."""


def clearance_studies(options: FigureOptions) -> tuple[Study, ...]:
    """One study a gap, for the amplitude goes with it."""
    return tuple(options.study(("hertz",), (gap_m,), gaps_m=(gap_m,)) for gap_m in GAPS_M)


def clearance_figure(options: FigureOptions, *results: StudyResults) -> DrawnFigure:
    """Draw both responses of every gap."""
    curves = [responses(each) for each in results]
    bound_hz = options.specimen().bound_frequencies_hz
    with styled():
        figure = new_figure(4.6)
        panels = figure.subplots(2, 1, sharex=True)
        for axes, what, label in zip(
            panels, ("response_i", "response_ii"), ("Response I of m0", "Response II of m0"), strict=True
        ):
            for at_hz in bound_hz:
                axes.axvline(float(at_hz), color=TERMINAL, linestyle=":", linewidth=1.0)
            for curve, gap_m, colour, line in zip(curves, GAPS_M, LEVELS, LEVEL_STYLES, strict=False):
                axes.plot(
                    curve.frequency_hz,
                    getattr(curve, what),
                    color=colour,
                    linestyle=line,
                    linewidth=1.0,
                    label=f"gap = A0 = {1e6 * gap_m:g} µm",
                )
            finish(axes, curves[0].frequency_hz, label)
        panels[1].set_xlabel("drive frequency [Hz]")
        legend_above(figure, [panels[0]])
    columns = {"frequency_hz": curves[0].frequency_hz}
    for curve, gap_m in zip(curves, GAPS_M, strict=True):
        columns[f"response_i_{1e6 * gap_m:g}um"] = curve.response_i
        columns[f"response_ii_{1e6 * gap_m:g}um"] = curve.response_ii
    return DrawnFigure(
        name="figure_11",
        title="Figure 11: influence of the gap when A0 equals it",
        caption=f"Dotted: resonances with m1 stuck to m2. {options.sentence}",
        figure=figure,
        tables=(table("figure_11", **columns),),
    )
