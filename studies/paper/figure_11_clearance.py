"""Fig. 11: influence of the gap, with A0 equal to the gap; two resonances remain at any gap."""

from vibench.analysis import report
from vibench.sim.study import Study, StudyResults

from .options import FigureOptions
from .responses import finish, responses

GAPS_M = (5e-6, 15e-6, 30e-6, 45e-6, 60e-6)
"""Gaps [m]; chosen for this figure, because the text of the paper does not give them."""


def studies(options: FigureOptions) -> tuple[Study, ...]:
    """Return one study per gap, with the amplitude equal to the gap."""
    return tuple(options.study(("hertz",), (gap_m,), gaps_m=(gap_m,)) for gap_m in GAPS_M)


def draw(options: FigureOptions, *results: StudyResults) -> report.DrawnFigure:
    """Draw both responses for every gap."""
    curves = {gap_m: responses(each) for gap_m, each in zip(GAPS_M, results, strict=True)}
    f = curves[GAPS_M[0]].frequency_hz
    columns = {"frequency_hz": f}
    with report.figure_style():
        figure = report.new_figure(4.6)
        panels = figure.subplots(2, 1, sharex=True)
        for axes, what, label in zip(
            panels, ("response_i", "response_ii"), ("Response I of m0", "Response II of m0"), strict=True
        ):
            for bound_hz in options.specimen().bound_frequencies_hz:
                axes.axvline(float(bound_hz), color=report.TERMINAL, linestyle=":", linewidth=1.0)
            axes.set_prop_cycle(color=report.LEVELS, linestyle=report.LEVEL_STYLES)
            for gap_m, curve in curves.items():
                name = f"gap = A0 = {1e6 * gap_m:g} µm"
                axes.plot(f, getattr(curve, what), linewidth=1.0, label=name)
            finish(axes, f, label)
            axes.label_outer()
        report.legend_above(figure, [panels[0]])
    for gap_m, curve in curves.items():
        columns[f"response_i_{1e6 * gap_m:g}um"] = curve.response_i
        columns[f"response_ii_{1e6 * gap_m:g}um"] = curve.response_ii
    return report.DrawnFigure(
        name="figure_11",
        title="Figure 11: influence of the gap when A0 equals it",
        caption=f"Dotted: resonances with m1 stuck to m2. {options.sentence}",
        figure=figure,
        tables=(report.table("figure_11", **columns),),
    )
