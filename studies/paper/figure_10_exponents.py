"""Fig. 10: largest exponents of the piece-wise and the continuous model, and the motion at 260 Hz."""

from typing import TYPE_CHECKING

import numpy as np

from vibench.analysis import report
from vibench.sim import Harmonic
from vibench.sim.study import Study, StudyResults

from .options import AMPLITUDES_M, WITH_EXPONENT, FigureOptions
from .responses import Reals, responses
from .time_signal import SPECTRUM_HZ, time_signal

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_PIECE_WISE, _CONTINUOUS = "hertz", "power:5"
_MODELS = (_PIECE_WISE, "power:3", _CONTINUOUS, "power:7", "power:3+5+7")
_MODERATE_M, _SHOWN_HZ = 5e-6, 260.0


def studies(options: FigureOptions) -> tuple[Study, ...]:
    """Return the studies of panels a to c (two models, four amplitudes) and d (all models at 5 um)."""
    return (
        options.study((_PIECE_WISE, _CONTINUOUS), AMPLITUDES_M, observe=WITH_EXPONENT),
        options.study(_MODELS, (_MODERATE_M,), observe=WITH_EXPONENT),
    )


def draw(options: FigureOptions, levels: StudyResults, models: StudyResults) -> report.DrawnFigure:
    """Draw exponents over frequency, by level and by model, and the spectra at 260 Hz by level."""
    f = np.asarray(levels.study.frequencies_hz)
    stops, continuous = (
        {a: responses(levels, model=model, amplitude=a).exponent_per_s for a in AMPLITUDES_M}
        for model in (_PIECE_WISE, _CONTINUOUS)
    )
    by_model = {model: responses(models, model=model).exponent_per_s for model in _MODELS}
    with report.figure_style():
        figure = report.new_figure(8.0)
        (first, second), (apart, kinds), (outlines, spectra) = figure.subplots(3, 2)
        _draw_exponents(first, f, _by_level(stops), "piece-wise")
        _draw_exponents(second, f, _by_level(continuous), "continuous, n = 5")
        _draw_exponents(apart, f, _by_level({a: stops[a] - continuous[a] for a in stops}), "their difference")
        labelled = {_label(model): values for model, values in by_model.items()}
        _draw_exponents(kinds, f, labelled, f"models at {1e6 * _MODERATE_M:g} µm")
        kinds.legend(fontsize=7)
        _draw_motions(outlines, spectra, options)
        report.legend_above(figure, [first], columns=4)
    columns: dict[str, Reals] = {"frequency_hz": f}
    for model, curves in ((_PIECE_WISE, stops), (_CONTINUOUS, continuous)):
        for amplitude_m, values in curves.items():
            columns[f"exponent_{model.replace(':', '_')}_{1e6 * amplitude_m:g}um_per_s"] = values
    for model, values in by_model.items():
        columns[f"exponent_{model.replace(':', '_').replace('+', '_')}_5um_by_model_per_s"] = values
    return report.DrawnFigure(
        name="figure_10",
        title="Figure 10: largest Lyapunov exponents",
        caption=(
            "Largest exponents of both models at four amplitudes, their difference, and those of all models "
            f"at 5 µm. Below: envelopes of the piece-wise model at {_SHOWN_HZ:g} Hz and spectra of the last "
            f"{options.window_s:g} s, in the colours of the amplitudes. {options.sentence}"
        ),
        figure=figure,
        tables=(report.table("figure_10", **columns),),
    )


def _by_level(curves: dict[float, Reals]) -> dict[str, Reals]:
    return {f"A0 = {1e6 * amplitude_m:g} µm": values for amplitude_m, values in curves.items()}


def _label(model: str) -> str:
    return "piece-wise" if model == _PIECE_WISE else f"n = {model.removeprefix('power:')}"


def _draw_exponents(axes: "Axes", f: Reals, curves: dict[str, Reals], title: str) -> None:
    axes.set_prop_cycle(color=report.LEVELS, linestyle=report.LEVEL_STYLES)
    for label, values in curves.items():
        axes.plot(f, values, linewidth=0.9, label=label)
    axes.axhline(0.0, color="#9a9a9a", linewidth=0.8)
    axes.set(
        xlim=(float(f[0]), float(f[-1])), title=title, ylabel="exponent [1/s]", xlabel="drive frequency [Hz]"
    )


def _draw_motions(outlines: "Axes", spectra: "Axes", options: FigureOptions) -> None:
    specimen = options.specimen(_PIECE_WISE)
    for amplitude_m, colour, line in zip(AMPLITUDES_M, report.LEVELS, report.LEVEL_STYLES, strict=False):
        signal = time_signal(specimen, Harmonic(_SHOWN_HZ, amplitude_m), options)
        outlines.fill_between(signal.time_s, signal.lower, signal.upper, color=colour, alpha=0.5, linewidth=0)
        f, shown = signal.frequency_hz, signal.frequency_hz <= SPECTRUM_HZ
        spectra.plot(f[shown], signal.amplitude[shown], color=colour, linestyle=line, linewidth=0.7)
    for bound_hz in specimen.bound_frequencies_hz:
        spectra.axvline(float(bound_hz), color=report.TERMINAL, linestyle=":", linewidth=1.0)
    report.magnitude_axis(spectra)
    spectra.set(
        ylim=(1e-5, 100),
        xlim=(0, SPECTRUM_HZ),
        xlabel="frequency [Hz]",
        ylabel="|x| / A0",
        title=f"piece-wise at {_SHOWN_HZ:g} Hz: spectra",
    )
    outlines.set(
        xlim=(0, options.duration_s),
        xlabel="time [s]",
        ylabel="x / A0",
        title=f"piece-wise at {_SHOWN_HZ:g} Hz: envelopes",
    )
