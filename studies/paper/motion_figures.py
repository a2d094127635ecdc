"""Figures with the motion at one frequency (Figs. 2, 4 and 10): 30 s, and the spectrum of the last 5 s."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from vibench.analysis import report
from vibench.sim import Harmonic, Specimen, integrate
from vibench.sim.study import StudyResults

from . import drawing
from .options import AMPLITUDES_M, WITH_EXPONENT, Case
from .responses import Reals, responses

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


SPECTRUM_HZ = 600.0
_RATE_HZ = 8192.0
_STRETCHES = 600
"""Number of sections of the outline, which shows the smallest and largest value in each section."""
_DECADES = 5.0
_MODERATE_M, _DEFINED_HZ, _SHOWN_HZ = 5e-6, 200.0, 260.0
_PIECE_WISE, _CONTINUOUS = "hertz", "power:5"
_MODELS = (_PIECE_WISE, "power:3", _CONTINUOUS, "power:7", "power:3+5+7")


@dataclass(frozen=True, eq=False)
class TimeSignal:
    """Motion of m0 under a sine, relative to the drive amplitude."""

    time_s: Reals
    """Middle of each outline section, shape (sections,)."""
    lower: Reals
    upper: Reals
    frequency_hz: Reals
    amplitude: Reals
    """Amplitude of each spectral line of the window, relative to A0; shape (lines,)."""


def time_signal(specimen: Specimen, drive: Harmonic, options: Case) -> TimeSignal:
    """Simulate a dwell from rest; return its outline and the spectrum of its last part."""
    run = integrate(specimen, drive, options.duration_s, options.accuracy, sample_rate_hz=_RATE_HZ)
    motion = run.states[:, 0] / drive.amplitude_m
    count = round(options.window_s * _RATE_HZ)
    taper = np.hanning(count)
    length = -(-motion.size // _STRETCHES)
    starts = np.arange(0, motion.size, length)
    return TimeSignal(
        time_s=np.minimum(starts + 0.5 * length, motion.size) / _RATE_HZ,
        lower=np.minimum.reduceat(motion, starts),
        upper=np.maximum.reduceat(motion, starts),
        frequency_hz=np.arange(count // 2 + 1, dtype=np.float64) * (_RATE_HZ / count),
        amplitude=np.asarray(2 * np.abs(np.fft.rfft(taper * motion[-count:])) / taper.sum()),
    )


def _draw_outline(axes: "Axes", signal: TimeSignal, options: Case, **look: Any) -> None:
    axes.fill_between(signal.time_s, signal.lower, signal.upper, linewidth=0, **look)
    axes.set(xlim=(0, options.duration_s), xlabel="time [s]", ylabel="x / A0")


def _draw_spectrum(axes: "Axes", signal: TimeSignal, **look: Any) -> float:
    """Draw the spectrum of the window; return its largest value."""
    shown = signal.frequency_hz <= SPECTRUM_HZ
    axes.plot(signal.frequency_hz[shown], signal.amplitude[shown], **look)
    report.magnitude_axis(axes)
    axes.set(xlim=(0, SPECTRUM_HZ), xlabel="frequency [Hz]", ylabel="|x| / A0")
    return float(np.max(signal.amplitude[shown]))


def _draw_motion(outline: "Axes", spectrum: "Axes", drive_hz: float, options: Case) -> Mapping[str, Reals]:
    """Draw the motion at 5 um, with window, terminal resonances and drive marked; return the spectrum."""
    specimen = options.specimen()
    signal = time_signal(specimen, Harmonic(drive_hz, _MODERATE_M), options)
    window_starts_s = options.duration_s - options.window_s
    outline.axvspan(window_starts_s, options.duration_s, color=report.COLLIDING, zorder=0)
    _draw_outline(outline, signal, options, color=report.MEASURED)
    drawing.draw_terminal(spectrum, specimen)
    spectrum.axvline(drive_hz, color=drawing.GREY, linestyle="--", linewidth=0.8)
    top = _draw_spectrum(spectrum, signal, color=report.MEASURED, linewidth=0.8)
    spectrum.set_ylim(top * 10**-_DECADES, 3 * top)
    return {"frequency_hz": signal.frequency_hz, "amplitude_over_a0": signal.amplitude}


@drawing.paper_figure(
    "2", "Responses I and II", 5.4, lambda options: (options.study((_PIECE_WISE,), (_MODERATE_M,)),)
)
def definitions(figure: "Figure", options: Case, results: StudyResults) -> drawing.Drawn:
    """Define Responses I and II by signal, spectrum and response curves at 5 um."""
    curve = responses(results)
    outline, spectrum, curves = figure.subplot_mosaic("AB;CC").values()
    spectrum_columns = _draw_motion(outline, spectrum, _DEFINED_HZ, options)
    drawing.draw_linear(curves, curve.frequency_hz, options.specimen())
    drawing.draw_responses(curves, curve)
    curves.axvline(_DEFINED_HZ, color=drawing.GREY, linestyle="--", linewidth=0.8)
    report.legend_above(figure, [curves])
    caption = (
        f"A0 = 5 µm. Above: motion of m0 at {_DEFINED_HZ:g} Hz (grey: the window observed) and its "
        "spectrum, terminal resonances dotted, drive dashed. Below: Response I, the largest |x| of the "
        "window; Response II, the component of x at the drive frequency."
    )
    return caption, {"": curve.columns("response_i", "response_ii"), "_spectrum": spectrum_columns}


@drawing.paper_figure(
    "4",
    "colliding and free states at 5 µm",
    7.6,
    lambda options: (options.study((_PIECE_WISE, "linear"), (_MODERATE_M,), observe=WITH_EXPONENT),),
)
def colliding_and_free(figure: "Figure", options: Case, results: StudyResults) -> drawing.Drawn:
    """Draw response, relative displacement and exponent over frequency, and the motion at 260 Hz."""
    curve, linear = (responses(results, model=each) for each in (_PIECE_WISE, "linear"))
    f = curve.frequency_hz
    *over_frequency, outline, spectrum = figure.subplot_mosaic("AA;BB;CC;DE").values()
    for axes in over_frequency:
        drawing.shade(axes, f, curve.collides, "m1 and m2 collide")
    first, relative, exponent = over_frequency
    drawing.draw_linear(first, f, options.specimen())
    first.plot(f, curve.response_i, color=report.MEASURED, label="Response I")
    drawing.finish(first, f, "x of m0 over A0")
    relative.plot(f, linear.relative_i, color=report.LINEAR, linestyle="--")
    relative.plot(f, curve.relative_i, color=report.MEASURED)
    gap_over_a0 = options.gap_m / _MODERATE_M
    relative.axhline(gap_over_a0, color=report.TERMINAL, linestyle=":", label="the gap over A0")
    drawing.finish(relative, f, "p over A0")
    for axes in (first, relative):
        axes.set_xlabel("")
    exponent.plot(f, curve.exponent_per_s, color=report.SIMULATED, label="largest exponent")
    exponent.axhline(0.0, color=drawing.GREY, linewidth=0.8)
    report.frequency_axis(exponent, max(float(f[0]), 10.0), float(f[-1]))
    exponent.set(ylabel="exponent [1/s]", xlabel="drive frequency [Hz]")
    spectrum_columns = _draw_motion(outline, spectrum, _SHOWN_HZ, options)
    report.legend_above(figure, over_frequency)
    figure.align_ylabels(over_frequency)
    caption = (
        "Grey: m1 and m2 collided within the window. Without collisions, the exponent equals the "
        f"exponent of the slowest mode. Below: the motion at {_SHOWN_HZ:g} Hz and the spectrum of its "
        f"last {options.window_s:g} s, terminal resonances dotted."
    )
    columns = curve.columns("response_i", "relative_i", "exponent_per_s", "collides")
    return caption, {"": columns, "_spectrum": spectrum_columns}


@drawing.paper_figure(
    "10",
    "largest Lyapunov exponents",
    8.0,
    lambda options: (
        options.study((_PIECE_WISE, _CONTINUOUS), AMPLITUDES_M, observe=WITH_EXPONENT),
        options.study(_MODELS, (_MODERATE_M,), observe=WITH_EXPONENT),
    ),
)
def exponents(figure: "Figure", options: Case, levels: StudyResults, models: StudyResults) -> drawing.Drawn:
    """Draw exponents over frequency, by level and by model, and the spectra at 260 Hz by level."""
    f = np.asarray(levels.study.frequencies_hz)
    stops, continuous = (
        {1e6 * a: responses(levels, model=model, amplitude=a).exponent_per_s for a in AMPLITUDES_M}
        for model in (_PIECE_WISE, _CONTINUOUS)
    )
    by_model = {model: responses(models, model=model).exponent_per_s for model in _MODELS}
    (first, second), (apart, kinds), (outlines, spectra) = figure.subplots(3, 2)
    for axes, title, curves in (
        (first, "piece-wise", stops),
        (second, "continuous, n = 5", continuous),
        (apart, "their difference", {a_um: stops[a_um] - continuous[a_um] for a_um in stops}),
    ):
        _draw_exponents(axes, f, {f"A0 = {a_um:g} µm": values for a_um, values in curves.items()}, title)
    labelled = {drawing.model_label(model): values for model, values in by_model.items()}
    _draw_exponents(kinds, f, labelled, f"models at {1e6 * _MODERATE_M:g} µm")
    kinds.legend(fontsize=7)
    _draw_levels(outlines, spectra, options)
    report.legend_above(figure, [first], columns=4)
    columns = {"frequency_hz": f}
    for model, by_level in ((_PIECE_WISE, stops), (_CONTINUOUS, continuous)):
        for a_um, values in by_level.items():
            columns[f"exponent_{drawing.model_name(model)}_{a_um:g}um_per_s"] = values
    for model, values in by_model.items():
        columns[f"exponent_{drawing.model_name(model)}_5um_by_model_per_s"] = values
    caption = (
        "Largest exponents of both models at four amplitudes, their difference, and the exponents of all "
        f"models at 5 µm. Below: envelopes of the piece-wise model at {_SHOWN_HZ:g} Hz and spectra of "
        f"the last {options.window_s:g} s, in the colours of the amplitudes."
    )
    return caption, {"": columns}


def _draw_exponents(axes: "Axes", f: Reals, curves: dict[str, Reals], title: str) -> None:
    axes.set_prop_cycle(color=report.LEVELS, linestyle=report.LEVEL_STYLES)
    for label, values in curves.items():
        axes.plot(f, values, linewidth=0.9, label=label)
    axes.axhline(0.0, color=drawing.GREY, linewidth=0.8)
    axes.set(xlim=(f[0], f[-1]), title=title, ylabel="exponent [1/s]", xlabel="drive frequency [Hz]")


def _draw_levels(outlines: "Axes", spectra: "Axes", options: Case) -> None:
    specimen = options.specimen(_PIECE_WISE)
    for amplitude_m, colour, line in zip(AMPLITUDES_M, report.LEVELS, report.LEVEL_STYLES, strict=False):
        signal = time_signal(specimen, Harmonic(_SHOWN_HZ, amplitude_m), options)
        _draw_outline(outlines, signal, options, color=colour, alpha=0.5)
        _draw_spectrum(spectra, signal, color=colour, linestyle=line, linewidth=0.7)
    drawing.draw_terminal(spectra, specimen)
    spectra.set(ylim=(1e-5, 100), title=f"piece-wise at {_SHOWN_HZ:g} Hz: spectra")
    outlines.set_title(f"piece-wise at {_SHOWN_HZ:g} Hz: envelopes")
