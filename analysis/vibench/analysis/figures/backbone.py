"""Figure of a tracked resonance: frequency and amplitude over base level, and the backbone curve."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from ..overlay.overlay import SteppedSineOverlay
from ..signals.arrays import Reals
from ..sine.stepped_response import (
    SteppedSineAnalysis,
    TrackedResonance,
    backbone_sentence,
    feedback_sentences,
    lost_levels,
    tracked_resonances,
)
from ..tables import rows, table
from . import style
from .stepped_sine import tracked_caption

_HEIGHT_IN = 4.2
_MARGIN = 0.15
"""Margin around the points, relative to their range, so that no point lies on the frame."""
_MOST_MARKS = 5
"""Maximum number of tick intervals on the backbone's frequency axis, as labels such as 266.385 are wide."""
_LEVEL = "base acceleration [m/s²]"
_PHASE = "phase resonance, ± two standard uncertainties"
_MODE = "natural frequency of the mode"
_LOST = "no resonance found at this level"
_SIMULATED = "simulated from the recorded base motion"
_MARK: dict[str, Any] = {"color": style.BOUNDS, "linestyle": "--", "linewidth": 0.8, "zorder": 1}
_MEASURED: dict[str, Any] = {"color": style.MEASURED, "marker": "o", "capsize": 2, "linewidth": 0.8}


def backbone_figure(
    analysis: SteppedSineAnalysis, overlay: SteppedSineOverlay | None = None
) -> style.DrawnFigure:
    """Draw resonance and amplitude over base level, and the backbone; mark levels without a resonance."""
    levels = tracked_resonances(analysis.facts.feedback)
    base = np.array([each.base_m_per_s2 for each in levels])
    simulated_m = _simulated_m(levels, analysis, overlay)
    lost = lost_levels(analysis.facts.feedback)
    with style.figure_style():
        figure = style.new_figure(_HEIGHT_IN)
        places = figure.subplot_mosaic([["frequency", "backbone"], ["amplitude", "backbone"]])
        broken = _interrupt(levels, lost)
        _frequencies(places["frequency"], broken)
        _amplitudes(places["amplitude"], broken, base, simulated_m)
        _backbone(places["backbone"], broken)
        for each in ("frequency", "amplitude"):
            for level in lost:
                places[each].axvline(level, label=_LOST, **_MARK)
            places[each].set_xlim(0.0, (1 + _MARGIN) * max((*base, *lost)))
        places["frequency"].sharex(places["amplitude"])
        places["frequency"].tick_params(labelbottom=False)
        style.legend_above(figure, [places["frequency"], places["amplitude"]], columns=2)
    name = f"backbone_{analysis.facts.name}"
    columns = rows(
        levels, "base_m_per_s2 frequency_hz u_frequency_hz mode_hz u_mode_hz damping_ratio amplitude_m"
    )
    if simulated_m is not None:
        columns["amplitude_m_simulated"] = simulated_m
    return style.DrawnFigure(
        name=name,
        title=f"Tracked resonance, around {np.median(columns['frequency_hz']):.4g} Hz",
        caption=_caption(analysis, levels),
        figure=figure,
        tables=(table(name, **columns),),
    )


def _interrupt(levels: Sequence[TrackedResonance], lost: Sequence[float]) -> list[TrackedResonance]:
    """Insert NaN at the levels without a resonance, so that lines are interrupted there."""
    nowhere = replace(levels[0], frequency_hz=np.nan, amplitude_m=np.nan, mode_hz=None, u_mode_hz=None)
    gaps = [replace(nowhere, base_m_per_s2=each) for each in lost]
    return sorted([*levels, *gaps], key=lambda each: each.base_m_per_s2)


def _amplitude(levels: Sequence[TrackedResonance]) -> tuple[Reals, float, str]:
    """Return amplitudes in a readable unit, the factor from metres to this unit, and the unit's name."""
    amplitude_m = np.array([each.amplitude_m for each in levels])
    scale, unit = style.with_prefix(float(np.nanmax(amplitude_m)), "m")
    return scale * amplitude_m, scale, unit


def _frequencies(axes: Axes, levels: Sequence[TrackedResonance]) -> None:
    base, frequency_hz, u_hz, mode_hz, u_mode_hz = rows(
        levels, "base_m_per_s2 frequency_hz u_frequency_hz mode_hz u_mode_hz"
    ).values()
    axes.errorbar(base, frequency_hz, 2 * u_hz, **_MEASURED, label=_PHASE)
    if np.isfinite(mode_hz).any():
        axes.errorbar(
            base, mode_hz, 2 * u_mode_hz, color=style.PREDICTED, marker="D", markerfacecolor="none",
            linestyle="none", capsize=2, linewidth=0.8, label=_MODE,
        )  # fmt: skip
    axes.set_ylabel("frequency [Hz]")
    axes.margins(_MARGIN)


def _amplitudes(
    axes: Axes, levels: Sequence[TrackedResonance], base: Reals, simulated_m: Reals | None
) -> None:
    amplitude, scale, unit = _amplitude(levels)
    axes.plot(
        [each.base_m_per_s2 for each in levels], amplitude, color=style.MEASURED, marker="o", linewidth=0.8
    )
    if simulated_m is not None:
        size = scale * simulated_m
        axes.plot(base, size, "s", color=style.SIMULATED, markerfacecolor="none", label=_SIMULATED)
    axes.set_xlabel(_LEVEL)
    axes.margins(_MARGIN)
    _from_zero(axes, levels, unit)


def _backbone(axes: Axes, levels: Sequence[TrackedResonance]) -> None:
    amplitude, _, unit = _amplitude(levels)
    frequency_hz, u_hz = rows(levels, "frequency_hz u_frequency_hz").values()
    axes.errorbar(frequency_hz, amplitude, xerr=2 * u_hz, **_MEASURED)
    axes.xaxis.set_major_locator(MaxNLocator(_MOST_MARKS))
    axes.set_xlabel("phase resonance [Hz]" if levels[0].is_fundamental else "drive at phase resonance [Hz]")
    axes.margins(_MARGIN)
    _from_zero(axes, levels, unit)


def _from_zero(axes: Axes, levels: Sequence[TrackedResonance], unit: str) -> None:
    """Label the amplitude axis, and set its range from zero to above the largest value."""
    of = "at resonance"
    if levels[0].harmonic > 1:
        of = f"at {levels[0].harmonic} times the drive"
    if levels[0].subharmonic > 1:
        of = f"at 1/{levels[0].subharmonic} of the drive"
    axes.set(ylabel=f"m0 {of} [{unit}]", ylim=(0.0, (1.0 + _MARGIN) * axes.dataLim.ymax))


def _simulated_m(
    levels: Sequence[TrackedResonance], analysis: SteppedSineAnalysis, overlay: SteppedSineOverlay | None
) -> Reals | None:
    """Return m0's simulated amplitude at each level; None if a level has no simulated amplitude."""
    if overlay is None or overlay.response.left_out or analysis.response.left_out:
        return None
    if not levels[0].is_fundamental:
        return None
    found = overlay.response.response_ii * overlay.response.drive_amplitude_m
    numbers = [each.number for each in levels]
    return found[numbers] if max(numbers) < found.size else None


def _caption(analysis: SteppedSineAnalysis, levels: Sequence[TrackedResonance]) -> str:
    feedback = feedback_sentences(analysis.facts.feedback)
    return " ".join(filter(None, (tracked_caption(analysis.response), backbone_sentence(levels), *feedback)))
