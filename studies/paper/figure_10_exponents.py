"""Fig. 10: largest exponents of the piece-wise and the continuous model, and the motion at 260 Hz."""

import numpy as np
from matplotlib.axes import Axes

from vibench.analysis.report import (
    LEVEL_STYLES,
    LEVELS,
    DrawnFigure,
    legend_above,
    magnitude_axis,
    new_figure,
    styled,
    table,
)
from vibench.sim.study import Study, StudyResults

from .options import AMPLITUDES_M, WITH_EXPONENT, FigureOptions
from .responses import Reals, drive_at, responses
from .time_signal import time_signal

_PIECE_WISE, _CONTINUOUS = "hertz", "power:5"
_MODELS = (_PIECE_WISE, "power:3", _CONTINUOUS, "power:7", "power:3+5+7")
_MODERATE_M, _SHOWN_HZ = 5e-6, 260.0
_SPECTRUM_HZ = 600.0


def exponents_study(options: FigureOptions) -> Study:
    """Both models of panels a to c at four amplitudes."""
    return options.study((_PIECE_WISE, _CONTINUOUS), AMPLITUDES_M, observe=WITH_EXPONENT)


def models_study(options: FigureOptions) -> Study:
    """All models of panel d at 5 um."""
    return options.study(_MODELS, (_MODERATE_M,), observe=WITH_EXPONENT)


def exponents_figure(options: FigureOptions, levels: StudyResults, models: StudyResults) -> DrawnFigure:
    """Draw exponents over frequency, by level and by model, and the spectra at 260 Hz by level."""
    f = np.asarray(levels.study.frequencies_hz)
    of = {
        model: {a: responses(levels, model=model, amplitude=a).exponent_per_s for a in AMPLITUDES_M}
        for model in (_PIECE_WISE, _CONTINUOUS)
    }
    with styled():
        figure = new_figure(8.0)
        panels = figure.subplots(3, 2)
        (pie, con), (apart, kinds), (last, spectra) = panels
        _by_level(pie, f, of[_PIECE_WISE], "piece-wise")
        _by_level(con, f, of[_CONTINUOUS], "continuous, n = 5")
        _by_level(
            apart, f, {a: of[_PIECE_WISE][a] - of[_CONTINUOUS][a] for a in AMPLITUDES_M}, "their difference"
        )
        for model, colour, line in zip(_MODELS, LEVELS, LEVEL_STYLES, strict=False):
            values = responses(models, model=model).exponent_per_s
            label = "piece-wise" if model == _PIECE_WISE else f"n = {model.removeprefix('power:')}"
            kinds.plot(f, values, color=colour, linestyle=line, linewidth=0.9, label=label)
        kinds.legend(fontsize=7)
        _finish(kinds, f, f"models at {1e6 * _MODERATE_M:g} µm")
        _at_260(last, spectra, options)
        legend_above(figure, [pie], columns=4)
    columns: dict[str, Reals] = {"frequency_hz": f}
    for model, curves in of.items():
        for amplitude_m, values in curves.items():
            columns[f"exponent_{model.replace(':', '_')}_{1e6 * amplitude_m:g}um_per_s"] = values
    for model in _MODELS:
        name = model.replace(":", "_").replace("+", "_")
        columns[f"exponent_{name}_5um_by_model_per_s"] = responses(models, model=model).exponent_per_s
    return DrawnFigure(
        name="figure_10",
        title="Figure 10: largest Lyapunov exponents",
        caption=(
            "Largest exponents of both models at four amplitudes, their difference, and those of all models "
            f"at 5 µm. Below: envelopes of the piece-wise model at {_SHOWN_HZ:g} Hz and spectra of the last "
            f"{options.window_s:g} s, in the colours of the amplitudes. {options.sentence}"
        ),
        figure=figure,
        tables=(table("figure_10", **columns),),
    )


def _by_level(axes: Axes, f: Reals, curves: dict[float, Reals], title: str) -> None:
    for (amplitude_m, values), colour, line in zip(curves.items(), LEVELS, LEVEL_STYLES, strict=False):
        label = f"A0 = {1e6 * amplitude_m:g} µm"
        axes.plot(f, values, color=colour, linestyle=line, linewidth=0.9, label=label)
    _finish(axes, f, title)


def _finish(axes: Axes, f: Reals, title: str) -> None:
    axes.axhline(0.0, color="#9a9a9a", linewidth=0.8)
    axes.set_xlim(float(f[0]), float(f[-1]))
    axes.set_title(title)
    axes.set_ylabel("exponent [1/s]")
    axes.set_xlabel("drive frequency [Hz]")


def _at_260(last: Axes, spectra: Axes, options: FigureOptions) -> None:
    specimen = options.specimen(_PIECE_WISE)
    for amplitude_m, colour, line in zip(AMPLITUDES_M, LEVELS, LEVEL_STYLES, strict=False):
        signal = time_signal(specimen, drive_at(_SHOWN_HZ, amplitude_m), options)
        outline = signal.outline
        last.fill_between(outline.time_s, outline.lower, outline.upper, color=colour, alpha=0.5, linewidth=0)
        shown = signal.frequency_hz <= _SPECTRUM_HZ
        spectra.plot(
            signal.frequency_hz[shown],
            signal.amplitude[shown],
            color=colour,
            linestyle=line,
            linewidth=0.7,
        )
    for bound_hz in specimen.bound_frequencies_hz:
        spectra.axvline(float(bound_hz), color="#8a3b7a", linestyle=":", linewidth=1.0)
    magnitude_axis(spectra)
    spectra.set_ylim(1e-5, 100)
    spectra.set_xlim(0, _SPECTRUM_HZ)
    spectra.set_xlabel("frequency [Hz]")
    spectra.set_ylabel("|x| / A0")
    spectra.set_title(f"piece-wise at {_SHOWN_HZ:g} Hz: spectra")
    last.set_xlim(0, options.duration_s)
    last.set_xlabel("time [s]")
    last.set_ylabel("x / A0")
    last.set_title(f"piece-wise at {_SHOWN_HZ:g} Hz: envelopes")
