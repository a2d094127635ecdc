"""Fig. 2: definition of Responses I and II, with a time signal at 200 Hz, its spectrum, and the curves."""

from vibench.analysis import report
from vibench.sim import Harmonic
from vibench.sim.study import Study, StudyResults

from .options import FigureOptions
from .responses import draw_linear, draw_responses, responses
from .time_signal import draw_outline, draw_spectrum, time_signal

_AMPLITUDE_M, _SHOWN_HZ = 5e-6, 200.0


def studies(options: FigureOptions) -> tuple[Study, ...]:
    """Return the study of Hertz stops at 5 um."""
    return (options.study(("hertz",), (_AMPLITUDE_M,)),)


def draw(options: FigureOptions, results: StudyResults) -> report.DrawnFigure:
    """Draw signal, spectrum and response curves at 5 um."""
    curve, specimen = responses(results), options.specimen()
    signal = time_signal(specimen, Harmonic(_SHOWN_HZ, _AMPLITUDE_M), options)
    with report.figure_style():
        figure = report.new_figure(5.4)
        grid = figure.add_gridspec(2, 2)
        outline, spectrum = figure.add_subplot(grid[0, 0]), figure.add_subplot(grid[0, 1])
        curves = figure.add_subplot(grid[1, :])
        draw_outline(outline, signal, options)
        draw_spectrum(spectrum, signal, specimen, _SHOWN_HZ)
        draw_linear(curves, curve.frequency_hz, specimen)
        draw_responses(curves, curve)
        curves.axvline(_SHOWN_HZ, color="#9a9a9a", linestyle="--", linewidth=0.8)
        report.legend_above(figure, [curves])
    return report.DrawnFigure(
        name="figure_2",
        title="Figure 2: Responses I and II",
        caption=(
            f"A0 = 5 µm. Above: motion of m0 at {_SHOWN_HZ:g} Hz (grey: the window observed) and its "
            "spectrum, terminal resonances dotted, drive dashed. Below: Response I, the largest |x| of the "
            f"window; Response II, its component at the drive frequency. {options.sentence}"
        ),
        figure=figure,
        tables=(
            report.table("figure_2", **curve.columns("response_i", "response_ii")),
            signal.spectrum_table("figure_2_spectrum"),
        ),
    )
