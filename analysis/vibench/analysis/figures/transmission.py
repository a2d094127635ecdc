"""Figure of the transmission at one noise level, with coherence and bounds (Fig. 13 a to c of the paper)."""

import numpy as np
from matplotlib.axes import Axes

from vibench.sim import base_transmissibility

from ..frequency_response.noise_response import NoiseAnalysis, NoiseResponse
from ..frequency_response.request import MagnitudeScale
from ..overlay.overlay import TRANSMISSION, NoiseOverlay
from ..recordings.facts import specimen_of
from ..signals.arrays import Reals
from ..tables import Table, columns, plus_minus, table
from . import style
from .ensemble_band import (
    ModelResonances,
    band_columns,
    draw_band,
    label_resonances,
    mark_resonances,
    model_resonances,
    run_text,
    simulated_label,
    sines_table,
)

_HEIGHT_IN = 6.4
_LARGEST_BOUND_RATIO = 10.0
"""Largest ratio of drawn bounds to the curve; wider bounds would fill the figure."""
_DIFFERENCE_LIMIT_DB = 12.0
_LINEAR_POINTS = 4000
_HALF_TURN_DEG = 180.0
_BELOW = 0.5
"""Lower end of the magnitude axis relative to the smallest drawn magnitude."""


def transmission_figure(analysis: NoiseAnalysis, overlay: NoiseOverlay | None = None) -> style.DrawnFigure:
    """Draw the measured and simulated transmission, their difference, and bounds, phase and coherence."""
    at = model_resonances(specimen_of(analysis.facts.bench) if overlay is None else overlay.run.specimen)
    with style.figure_style():
        figure = style.new_figure(_HEIGHT_IN)
        rows = 3 if overlay is None else 4
        panels = figure.subplots(
            rows, 1, sharex=True, height_ratios=(3.6, 1.2, 1.0, 1.0)[:rows], squeeze=False
        )
        top = panels[0, 0]
        _magnitudes(top, analysis, overlay, at)
        _phases(panels[1, 0], analysis, overlay, at)
        _coherence(panels[2, 0], analysis, at)
        if overlay is not None:
            _differences(panels[3, 0], overlay, at)
        panels[-1, 0].set_xlabel("frequency [Hz]")
        found = analysis.response.frequency_response.frequency_hz
        style.frequency_axis(top, float(found[0]), float(found[-1]))
        label_resonances(top, at)
        style.legend_above(figure, [top], columns=2)
        figure.align_ylabels()
    return style.DrawnFigure(
        name=f"transmission_{analysis.facts.name}",
        title=f"{analysis.view.title}, {analysis.facts.measurement.excitation.amplitude_vpp:g} Vpp noise",
        caption=transmission_caption(analysis, overlay),
        figure=figure,
        tables=_tables(analysis, overlay),
    )


def _magnitudes(
    axes: Axes, analysis: NoiseAnalysis, overlay: NoiseOverlay | None, at: ModelResonances
) -> None:
    view = analysis.view
    measured = view.apply(analysis.response.frequency_response)
    size = measured.magnitude
    low = np.maximum(measured.magnitude_lower, size / _LARGEST_BOUND_RATIO)
    high = np.minimum(measured.magnitude_upper, size * _LARGEST_BOUND_RATIO)
    mark_resonances(axes, at)
    bounds = f"{100 * measured.settings.confidence:g} % bounds"
    axes.fill_between(
        measured.frequency_hz, view.place(low), view.place(high), color=style.BOUNDS, alpha=0.45, label=bounds
    )
    if overlay is not None:
        simulated, sines = view.apply(overlay.response.frequency_response), overlay.prediction
        fine_hz = np.geomspace(measured.frequency_hz[0], measured.frequency_hz[-1], _LINEAR_POINTS)
        linear = np.abs(base_transmissibility(overlay.run.specimen, fine_hz)[:, 0])
        linear = view.place(linear * view.factor(fine_hz))
        axes.plot(fine_hz, linear, **style.LINEAR_CURVE)
        micrometres = 1e6 * float(sines.amplitude_m[0])
        response_i = view.place(sines.response_i * view.factor(sines.frequency_hz))
        label = f"Response I, sines of A0 = {micrometres:.3g} µm"
        axes.plot(sines.frequency_hz, response_i, color=style.PREDICTED, linewidth=0.9, label=label)
        factor = view.factor(simulated.frequency_hz)
        middle = draw_band(
            axes, simulated.frequency_hz, overlay, TRANSMISSION, lambda values: view.place(values * factor)
        )
        curve = view.place(simulated.magnitude) if middle is None else middle
        axes.plot(simulated.frequency_hz, curve, label=simulated_label(overlay.run), **style.SIMULATED_CURVE)
    axes.plot(measured.frequency_hz, view.place(size), color=style.MEASURED, label="measured", zorder=3)
    peaks = analysis.response.resonances
    peaks_hz = np.array([each.peak_frequency_hz for each in peaks])
    heights = np.array([each.peak_magnitude for each in peaks])
    tops, label_found = view.place(heights * view.factor(peaks_hz)), "resonances found" if peaks else None
    axes.plot(peaks_hz, tops, "v", color=style.MEASURED, label=label_found, zorder=4)
    if view.scale is MagnitudeScale.LOG:
        style.magnitude_axis(axes)
    seen = size[np.isfinite(size) & (size > 0)]
    if seen.size:
        axes.set_ylim(bottom=float(view.place(np.array([_BELOW * np.min(seen)]))[0]))
    axes.set_ylabel(view.label(analysis.facts.mass))


def _phases(axes: Axes, analysis: NoiseAnalysis, overlay: NoiseOverlay | None, at: ModelResonances) -> None:
    """Draw the phase from -180 to 180 degrees, with bounds where these are narrower than a full turn."""
    view = analysis.view
    measured = view.apply(analysis.response.frequency_response)
    mark_resonances(axes, at)
    low, high = np.rad2deg(measured.phase_lower_rad), np.rad2deg(measured.phase_upper_rad)
    axes.fill_between(measured.frequency_hz, low, high, color=style.BOUNDS, alpha=0.45)
    if overlay is not None:
        simulated = view.apply(overlay.response.frequency_response)
        phase = _cut_wrap(simulated.frequency_hz, np.rad2deg(simulated.phase_rad))
        axes.plot(*phase, **style.SIMULATED_CURVE)
    axes.plot(
        *_cut_wrap(measured.frequency_hz, np.rad2deg(measured.phase_rad)), color=style.MEASURED, linewidth=0.9
    )
    axes.set(
        ylim=(-_HALF_TURN_DEG, _HALF_TURN_DEG),
        yticks=[-_HALF_TURN_DEG, 0, _HALF_TURN_DEG],
        ylabel="phase [°]",
    )


def _cut_wrap(frequency_hz: Reals, phase_deg: Reals) -> tuple[Reals, Reals]:
    """Return a phase curve interrupted where it wraps, so that no line crosses the panel."""
    wraps = np.flatnonzero(np.abs(np.diff(phase_deg)) > _HALF_TURN_DEG) + 1
    return np.insert(frequency_hz, wraps, frequency_hz[wraps]), np.insert(phase_deg, wraps, np.nan)


def _coherence(axes: Axes, analysis: NoiseAnalysis, at: ModelResonances) -> None:
    measured = analysis.response.frequency_response
    mark_resonances(axes, at)
    axes.plot(measured.frequency_hz, measured.coherence, color=style.MEASURED, linewidth=0.8)
    axes.axhline(measured.coherence_significance, color=style.SIMULATED, linewidth=0.9, linestyle="-.")
    axes.set(ylim=(0, 1.05), ylabel="coherence")


def _differences(axes: Axes, overlay: NoiseOverlay, at: ModelResonances) -> None:
    mark_resonances(axes, at)
    shown = np.clip(overlay.difference.decibel, -_DIFFERENCE_LIMIT_DB, _DIFFERENCE_LIMIT_DB)
    axes.plot(overlay.difference.frequency_hz, shown, color=style.SIMULATED, linewidth=0.8)
    axes.axhline(0, color=style.MEASURED, linewidth=0.6)
    reach = max(1.0, float(np.nanmax(np.abs(shown))) * 1.1)
    axes.set(ylim=(-reach, reach), ylabel="meas. − sim.\n[dB]")


def transmission_caption(analysis: NoiseAnalysis, overlay: NoiseOverlay | None) -> str:
    """Return the caption with level, resonances, coherence and agreement of the simulation."""
    response = analysis.response
    view = analysis.view
    symbol, unit = view.symbol.replace(" ", ""), f" {view.unit}" if view.unit else ""
    found = ", ".join(
        f"{plus_minus(each.frequency_hz, 2 * each.sd_frequency_hz)} Hz ({symbol} = "
        f"{each.peak_magnitude * float(view.factor(np.array([each.peak_frequency_hz]))[0]):.3g}{unit})"
        for each in response.resonances
    )
    sentences = [
        (
            f"Noise at {analysis.excitation.amplitude_vpp:g} Vpp, base acceleration "
            f"{response.base_level.rms_acceleration:.3g} m/s² rms between {response.base_level.low_hz:g} and "
            f"{response.base_level.high_hz:g} Hz; {response.frequency_response.n_eff:.3g} independent "
            f"averages from {response.used_s:.0f} s in total."
        ),
        estimate_sentence(response),
        f"Resonances found: {found}." if found else "No significant resonance was found.",
        (
            f"Median coherence {response.median_coherence:.4f}; dash-dotted: coherence that independent "
            "noise would show."
        ),
    ]
    if overlay is not None:
        sentences.append(
            f"{run_text(overlay)} Median difference {overlay.difference.median_abs_db:.2g} dB. "
            f"The blue curve is the predicted Response I to sines instead of noise "
            f"({overlay.amplitude_basis}); it is not fitted."
        )
    return " ".join(sentences)


def estimate_sentence(response: NoiseResponse) -> str:
    """Return sentences on the estimator, the resolution, and the data that were left out."""
    found = response.frequency_response
    how = found.settings
    ratio = "" if how.noise_ratio is None else f" with a noise ratio of {how.noise_ratio:g} s²"
    if response.hits is not None:
        fineness = (
            f"hits of {how.segment_s:.3g} s with a window exp(-{how.decay_per_s:.3g} t), which "
            "widens the lines; the stated resonances are corrected for this"
        )
    elif response.periodic is None:
        fineness = (
            f"{how.window} segments of {how.segment_samples / how.sample_rate_hz:.3g} s overlapping by "
            f"{100 * how.overlap:g} %, lines {found.resolution_hz:.3g} Hz wide"
        )
    else:
        fineness = f"whole periods of {how.segment_samples / how.sample_rate_hz:.3g} s, lines without leakage"
    text = f"Estimator {how.estimator.value}{ratio}; {fineness}."
    if not response.left_out:
        return text
    parts = "realisations" if response.periodic else "hits" if response.hits else "segments"
    return (
        f"{text} Left out: {response.left_out} {parts}, because of {response.lost_samples} lost and "
        f"{response.overloaded_samples} overloaded samples, or because they are incomplete."
    )


def _tables(analysis: NoiseAnalysis, overlay: NoiseOverlay | None) -> tuple[Table, ...]:
    view = analysis.view
    measured = view.apply(analysis.response.frequency_response)
    name = f"transmission_{analysis.facts.name}"
    found = columns(
        measured,
        "frequency_hz magnitude magnitude_lower magnitude_upper magnitude_db=decibel phase_rad "
        "phase_lower_rad phase_upper_rad coherence",
    )
    found["magnitude_h1"] = view.apply(analysis.response.h1).magnitude
    found["magnitude_h2"] = view.apply(analysis.response.h2).magnitude
    if overlay is None:
        return (table(name, **found),)
    found |= band_columns(overlay, TRANSMISSION, "transmission")
    found["magnitude_simulated"] = view.apply(overlay.response.frequency_response).magnitude
    found |= columns(overlay.difference, "difference_db=decibel difference_standard_errors=standard_errors")
    return table(name, **found), sines_table(name, overlay.prediction)
