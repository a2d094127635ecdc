"""Figures of noise: transmission (Fig. 13 a to c of the paper), scans, distortion, and several levels."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import ArrayLike

from vibench.sim import Specimen, base_transmissibility

from ..frequency_response.noise_response import Distortion, NoiseAnalysis, NoiseResponse, distortion
from ..frequency_response.periodic import PeriodicFrequencyResponse
from ..frequency_response.results import MagnitudeScale
from ..overlay.overlay import TRANSMISSION, NoiseOverlay
from ..recordings.facts import specimen_of
from ..results.spectral_functions import Scan
from ..signals import Reals
from ..tables import Table, columns, plus_minus, table
from . import _style as style

_HEIGHT_IN = 6.4
_LARGEST_BOUND_RATIO = 10.0
"""Largest ratio of the drawn bounds to the curve; wider bounds would fill the whole figure."""
_DIFFERENCE_LIMIT_DB = 12.0
_LINEAR_POINTS = 4000
_HALF_TURN_DEG = 180.0
_BELOW = 0.5
"""Lower end of the magnitude axis relative to the smallest drawn magnitude."""


def transmission_figure(analysis: NoiseAnalysis, overlay: NoiseOverlay | None = None) -> style.DrawnFigure:
    """Draw the measured and simulated transmission, their difference, and bounds, phase and coherence."""
    at = specimen_of(analysis.facts.bench) if overlay is None else overlay.run.specimen
    with style.drawing(_HEIGHT_IN) as figure:
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
        style.label_resonances(top, at)
        style.legend_above(figure, [top], columns=2)
        figure.align_ylabels()
    return style.DrawnFigure(
        name=f"transmission_{analysis.facts.name}",
        title=f"{analysis.view.title}, {analysis.facts.measurement.excitation.amplitude_vpp:g} Vpp noise",
        caption=transmission_caption(analysis, overlay),
        figure=figure,
        tables=_tables(analysis, overlay),
    )


def _magnitudes(axes: Axes, analysis: NoiseAnalysis, overlay: NoiseOverlay | None, at: Specimen) -> None:
    view = analysis.view
    measured = view.apply(analysis.response.frequency_response)
    size = measured.magnitude
    low = np.maximum(measured.magnitude_lower, size / _LARGEST_BOUND_RATIO)
    high = np.minimum(measured.magnitude_upper, size * _LARGEST_BOUND_RATIO)
    style.mark_resonances(axes, at)
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
        middle = style.draw_band(
            axes, simulated.frequency_hz, overlay, TRANSMISSION, lambda values: view.place(values * factor)
        )
        curve = view.place(simulated.magnitude) if middle is None else middle
        axes.plot(
            simulated.frequency_hz, curve, label=style.simulated_label(overlay.run), **style.SIMULATED_CURVE
        )
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


def _phases(axes: Axes, analysis: NoiseAnalysis, overlay: NoiseOverlay | None, at: Specimen) -> None:
    """Draw the phase from -180 to 180 degrees, with bounds where these are narrower than a full turn."""
    view = analysis.view
    measured = view.apply(analysis.response.frequency_response)
    style.mark_resonances(axes, at)
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


def _coherence(axes: Axes, analysis: NoiseAnalysis, at: Specimen) -> None:
    measured = analysis.response.frequency_response
    style.mark_resonances(axes, at)
    axes.plot(measured.frequency_hz, measured.coherence, color=style.MEASURED, linewidth=0.8)
    axes.axhline(measured.coherence_significance, color=style.SIMULATED, linewidth=0.9, linestyle="-.")
    axes.set(ylim=(0, 1.05), ylabel="coherence")


def _differences(axes: Axes, overlay: NoiseOverlay, at: Specimen) -> None:
    style.mark_resonances(axes, at)
    shown = np.clip(overlay.difference.decibel, -_DIFFERENCE_LIMIT_DB, _DIFFERENCE_LIMIT_DB)
    axes.plot(overlay.difference.frequency_hz, shown, color=style.SIMULATED, linewidth=0.8)
    axes.axhline(0, color=style.MEASURED, linewidth=0.6)
    reach = 1.1 * float(np.nanmax(np.abs(shown), initial=1.0))
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
            f"{style.run_text(overlay)} Median difference {overlay.difference.median_abs_db:.2g} dB. "
            f"The blue curve is the predicted Response I to sines instead of noise "
            f"({overlay.amplitude_basis}); this curve is not fitted."
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
    found |= style.band_columns(overlay, TRANSMISSION, "transmission")
    found["magnitude_simulated"] = view.apply(overlay.response.frequency_response).magnitude
    found |= columns(overlay.difference, "difference_db=decibel difference_standard_errors=standard_errors")
    return table(name, **found), style.sines_table(name, overlay.prediction)


_SCAN_HEIGHT_IN = 4.6
_MOST_NAMES = 16
"""Largest number of points named at the axis; if there are more, node numbers replace the names."""


def scan_figure(scan: Scan) -> style.DrawnFigure:
    """Draw the operating deflection shape at each resonance."""
    view, points = scan.analyses[0].request.view, scan.points
    places = np.arange(len(points))
    columns: dict[str, ArrayLike] = {
        "node": np.array(scan.nodes),
        **{f"{axis}_m": np.array([getattr(each, f"{axis}_m") for each in points]) for axis in "xyz"},
    }
    with style.drawing(_SCAN_HEIGHT_IN) as figure:
        magnitudes, phases = figure.subplots(2, 1, sharex=True)
        for number, shape in enumerate(scan.shapes):
            look = {
                "color": style.LEVELS[number % len(style.LEVELS)],
                "linestyle": style.LEVEL_STYLES[number % len(style.LEVEL_STYLES)],
                "marker": "o",
                "markersize": 3.5,
                "capsize": 2,
                "linewidth": 1.0,
            }
            size = np.abs(shape.values)
            drawn = view.place(size)
            low, high = (view.place(each) for each in shape.magnitude_bounds)
            high = np.where(np.isfinite(high), high, drawn)
            magnitudes.errorbar(
                places, drawn, (drawn - low, high - drawn), label=f"{shape.frequency_hz:.1f} Hz", **look
            )
            phases.errorbar(places, shape.phase_deg, shape.phase_half_width_deg, **look)
            at = f"{shape.frequency_hz:.1f}hz"
            columns |= {f"magnitude_{at}": size, f"phase_deg_{at}": shape.phase_deg}
            columns[f"relative_half_width_{at}"] = shape.half_width
        if view.scale is MagnitudeScale.LOG:
            style.magnitude_axis(magnitudes)
        magnitudes.set_ylabel(view.label("point"))
        phases.set(ylabel="phase [°]", ylim=(-190, 190), yticks=[-180, -90, 0, 90, 180])
        few = len(points) <= _MOST_NAMES
        names = [
            style.plain_label(each.name) if few else str(node)
            for node, each in zip(scan.nodes, points, strict=True)
        ]
        shown = places if few else places[:: -(-len(points) // _MOST_NAMES)]
        phases.set_xticks(shown, [names[place] for place in shown])
        phases.set_xlabel("point" if few else "node")
        style.legend_above(figure, [magnitudes], columns=4)
    where = ", ".join(f"{each.frequency_hz:.1f}" for each in scan.shapes)
    confidence = scan.analyses[0].response.frequency_response.settings.confidence
    return style.DrawnFigure(
        name=f"scan_{scan.analyses[0].facts.name}",
        title=f"Scan {scan.name}: shapes at the resonances",
        caption=(
            f"Measured transmission from base to {len(scan.points)} points, and its phase, at "
            f"{f'the resonances {where} Hz' if where else 'no resonance, because none is significant'}. "
            f"Values and bars ({100 * confidence:g} % bounds): at the spectral line nearest to each "
            "resonance."
        ),
        figure=figure,
        tables=(table(f"scan_{scan.analyses[0].facts.name}", **columns),),
    )


_DISTORTION_HEIGHT_IN = 4.6
_DISTORTION_LOW_HEIGHT_IN = 3.0
_EVEN, _ODD = style.LINEAR, style.SIMULATED


def distortion_figure(analysis: NoiseAnalysis, periodic: PeriodicFrequencyResponse) -> style.DrawnFigure:
    """Draw standard deviations due to noise and distortion, and levels at undriven spectral lines."""
    lines = periodic.detection
    has_quiet_lines = lines.order.size > 0
    with style.drawing(_DISTORTION_HEIGHT_IN if has_quiet_lines else _DISTORTION_LOW_HEIGHT_IN) as figure:
        panels: list[Axes] = list(figure.subplots(1 + has_quiet_lines, 1, sharex=True, squeeze=False)[:, 0])
        _shares(panels[0], periodic)
        if has_quiet_lines:
            _detection(panels[1], periodic)
        panels[-1].set_xlabel("frequency [Hz]")
        driven_hz = periodic.frequency_response.frequency_hz
        style.frequency_axis(panels[0], float(driven_hz[0]), float(driven_hz[-1]))
        style.legend_above(figure, panels)
        figure.align_ylabels()
    name = f"distortion_{analysis.facts.name}"
    varied = periodic.distortion_variance
    columns = {
        "frequency_hz": driven_hz,
        "noise_share": _share(periodic.noise_variance, periodic),
        **({} if varied is None else {"distortion_share": _share(varied, periodic)}),
        "detection_frequency_hz": lines.frequency_hz,
        "detection_order": lines.order,
        "detection_m_per_s": lines.response_amplitude,
        "detection_noise_m_per_s": lines.noise_amplitude,
    }
    return style.DrawnFigure(
        name=name,
        title=f"Noise and distortion, {analysis.excitation.amplitude_vpp:g} Vpp noise",
        caption=distortion_caption(periodic),
        figure=figure,
        tables=(table(name, **columns),),
    )


def _share(variance: Reals, periodic: PeriodicFrequencyResponse) -> Reals:
    return np.asarray(np.sqrt(variance) / periodic.frequency_response.magnitude)


def _shares(axes: Axes, periodic: PeriodicFrequencyResponse) -> None:
    frequency_hz = periodic.frequency_response.frequency_hz
    noise = _share(periodic.noise_variance, periodic)
    label = "not repeating (noise or chaos), one realisation"
    axes.plot(frequency_hz, noise, color=style.BOUNDS, linewidth=0.9, label=label)
    varied = periodic.distortion_variance
    if varied is not None:
        # If noise explains the whole scatter, there is no distortion to draw.
        seen = np.where(varied > 0, _share(varied, periodic), np.nan)
        axes.plot(frequency_hz, seen, ".-", color=style.MEASURED, linewidth=0.7, label="nonlinear distortion")
    style.magnitude_axis(axes)
    axes.set_ylabel("sd over |H|")


def _detection(axes: Axes, periodic: PeriodicFrequencyResponse) -> None:
    lines = periodic.detection
    is_even = lines.order % 2 == 0
    for chosen, colour, marker, label in (
        (is_even, _EVEN, "o", "even lines, not driven"),
        (~is_even, _ODD, "x", "odd lines, not driven"),
    ):
        size = lines.response_amplitude[chosen]
        axes.plot(lines.frequency_hz[chosen], size, marker, color=colour, markersize=2.5, label=label)
    label = "noise or chaos on these lines"
    axes.plot(lines.frequency_hz, lines.noise_amplitude, ":", color=style.BOUNDS, linewidth=0.9, label=label)
    style.magnitude_axis(axes)
    axes.set_ylabel("velocity of the mass [m/s]")


def distortion_caption(periodic: PeriodicFrequencyResponse) -> str:
    """Return the caption with the contributions of noise and distortion to the scatter."""
    found = distortion(periodic)
    parts = [
        (
            f"From {periodic.realisations} realisations: standard deviation of one realisation, relative to "
            f"the transmission (median): {_percent(found.noise_share)} due to channel noise or chaos of "
            "the specimen, which do not repeat each period"
        )
    ]
    if found.distortion_share is None:
        parts.append("; one realisation cannot show distortion.")
    else:
        # Near a narrow mode with a drifting frequency, a part of the drift counts as distortion.
        most = "at most " if found.drift and found.drift.frequency_share + found.drift.common_share else ""
        parts.append(f"; {most}{_percent(found.distortion_share)} due to distortion.")
    if periodic.drift is not None:
        parts.append(f" The {periodic.drift.text}; this is not distortion.")
    return "".join(parts) + _quiet_text(found)


def _percent(share: float) -> str:
    """Return a percentage with two digits, not as a power of ten, because it often exceeds 100 % in chaos."""
    return f"{100 * share:.0f} %" if share >= 1 else f"{100 * share:.2g} %"


def _quiet_text(found: Distortion) -> str:
    levels = {"even": found.even_m_per_s, "odd": found.odd_m_per_s}
    shown = [f"{1e6 * level:.3g} µm/s on {name} lines" for name, level in levels.items() if level is not None]
    if not shown or found.detection_noise_m_per_s is None:
        return ""
    return (
        f" Level of the lines that were not driven: {' and '.join(shown)} (rms, without the non-repeating "
        f"part, {1e6 * found.detection_noise_m_per_s:.2g} µm/s). This level is the even and odd distortion "
        "of the whole path from the drive voltage to the mass."
    )


_LEVELS_HEIGHT_IN = 4.0


def transmission_levels_figure(analyses: Sequence[NoiseAnalysis]) -> style.DrawnFigure:
    """Draw the transmissions at one or more noise levels, weak to strong."""
    rising = sorted(analyses, key=lambda each: each.excitation.amplitude_vpp)
    view = rising[0].view
    at = specimen_of(rising[0].facts.bench)
    with style.drawing(_LEVELS_HEIGHT_IN) as figure:
        axes = figure.subplots()
        style.mark_resonances(axes, at)
        for number, each in enumerate(rising):
            found = view.apply(each.response.frequency_response)
            level = each.response.base_level.rms_acceleration
            label = f"{each.excitation.amplitude_vpp:g} Vpp ({level:.2g} m/s² rms)"
            line = style.LEVEL_STYLES[number % len(style.LEVELS)]
            colour = style.LEVELS[number % len(style.LEVELS)]
            size = view.place(found.magnitude)
            axes.plot(found.frequency_hz, size, line, color=colour, linewidth=1.0, label=label)
        if view.scale is MagnitudeScale.LOG:
            style.magnitude_axis(axes)
        axes.set(ylabel=view.label(rising[0].facts.mass), xlabel="frequency [Hz]")
        lows = [float(each.response.frequency_response.frequency_hz[0]) for each in rising]
        highs = [float(each.response.frequency_response.frequency_hz[-1]) for each in rising]
        style.frequency_axis(axes, min(lows), max(highs))
        style.label_resonances(axes, at)
        style.legend_above(figure, [axes], columns=2)
    columns = {}
    for each in rising:
        columns[f"frequency_hz_{each.facts.name}"] = each.response.frequency_response.frequency_hz
        columns[f"magnitude_{each.facts.name}"] = view.apply(each.response.frequency_response).magnitude
    return style.DrawnFigure(
        name="transmission_levels",
        title=f"{view.title} at all noise levels",
        caption=transmission_levels_caption(rising),
        figure=figure,
        tables=(table("transmission_levels", **columns),),
    )


def transmission_levels_caption(rising: Sequence[NoiseAnalysis]) -> str:
    """Return the caption with the resonances at each noise level."""
    levels = []
    for each in rising:
        peaks = [f"{found.frequency_hz:.0f}" for found in each.response.resonances]
        plural = "s" * (len(peaks) > 1)
        where = f"resonance{plural} at {', '.join(peaks)} Hz" if peaks else "no clear resonance"
        levels.append(f"{each.excitation.amplitude_vpp:g} Vpp: {where}")
    return (
        f"Measured {rising[0].view.symbol} of {rising[0].facts.response} at {len(rising)} noise levels. "
        f"{'; '.join(levels)}. Dashed: resonances of the model without contact; dotted: with m1 stuck to "
        "m2 (limit of strong collisions)."
    )
