"""Fig. 4: motion at 5 um with and without stops. Response, p and exponent; time signal at 260 Hz."""

from vibench.analysis import report
from vibench.sim import Harmonic
from vibench.sim.study import Study, StudyResults

from .options import WITH_EXPONENT, FigureOptions
from .responses import draw_linear, finish, responses, shade
from .time_signal import draw_outline, draw_spectrum, time_signal

_AMPLITUDE_M, _SHOWN_HZ = 5e-6, 260.0


def studies(options: FigureOptions) -> tuple[Study, ...]:
    """Return the study with and without stops at 5 um, with the largest exponent."""
    return (options.study(("hertz", "linear"), (_AMPLITUDE_M,), observe=WITH_EXPONENT),)


def draw(options: FigureOptions, results: StudyResults) -> report.DrawnFigure:
    """Draw response, relative displacement and exponent over frequency, and the motion at 260 Hz."""
    curve, linear = responses(results, model="hertz"), responses(results, model="linear")
    specimen = options.specimen()
    signal = time_signal(specimen, Harmonic(_SHOWN_HZ, _AMPLITUDE_M), options)
    f = curve.frequency_hz
    with report.figure_style():
        figure = report.new_figure(7.6)
        grid = figure.add_gridspec(4, 2)
        first, relative, exponent = (figure.add_subplot(grid[row, :]) for row in range(3))
        for axes in (first, relative, exponent):
            shade(axes, f, curve.collides, "m1 and m2 collide")
        draw_linear(first, f, specimen)
        first.plot(f, curve.response_i, color=report.MEASURED, label="Response I")
        finish(first, f, "x of m0 over A0")
        relative.plot(f, linear.relative_i, color=report.LINEAR, linestyle="--")
        relative.plot(f, curve.relative_i, color=report.MEASURED)
        relative.axhline(
            options.gap_m / _AMPLITUDE_M, color=report.TERMINAL, linestyle=":", label="the gap over A0"
        )
        finish(relative, f, "p over A0")
        for axes in (first, relative):
            axes.set_xlabel("")
        exponent.plot(f, curve.exponent_per_s, color=report.SIMULATED, label="largest exponent")
        exponent.axhline(0.0, color="#9a9a9a", linewidth=0.8)
        report.frequency_axis(exponent, max(float(f[0]), 10.0), float(f[-1]))
        exponent.set(ylabel="exponent [1/s]", xlabel="drive frequency [Hz]")
        draw_outline(figure.add_subplot(grid[3, 0]), signal, options)
        draw_spectrum(figure.add_subplot(grid[3, 1]), signal, specimen, _SHOWN_HZ)
        report.legend_above(figure, [first, relative, exponent])
        figure.align_ylabels([first, relative, exponent])
    return report.DrawnFigure(
        name="figure_4",
        title="Figure 4: colliding and free states at 5 µm",
        caption=(
            "Grey: m1 and m2 collided within the window. Without collisions, the exponent is that of the "
            f"slowest mode. Below: the motion at {_SHOWN_HZ:g} Hz and the spectrum of its last "
            f"{options.window_s:g} s, terminal resonances dotted. {options.sentence}"
        ),
        figure=figure,
        tables=(
            report.table(
                "figure_4", **curve.columns("response_i", "relative_i", "exponent_per_s", "collides")
            ),
            signal.spectrum_table("figure_4_spectrum"),
        ),
    )
