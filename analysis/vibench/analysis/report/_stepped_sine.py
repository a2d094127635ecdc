"""Figures of stepped sines: Responses I and II of each step, and the backbone of tracked resonances."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Generic, TypeVar

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from vibench.acquisition.plan import (
    EXCITATION_KINDS,
    ResonanceTracking,
    SettledSine,
    SteppedLevel,
    SteppedSine,
)

from ..overlay.overlay import RESPONSE_I, RESPONSE_II, SteppedSineOverlay
from ..signals import Flags, Reals
from ..sine.stepped_response import (
    SteppedResponse,
    SteppedSineAnalysis,
    TrackedResonance,
    backbone_sentence,
    feedback_sentences,
    hysteresis_vpp,
    level_jumps,
    lost_levels,
    noted_jumps,
    tracked_resonances,
)
from ..tables import columns, plus_minus, rows, table
from . import _style as style

_HEIGHT_IN = 4.6
_MARKERS = {"up": "^", "down": "v"}


P = TypeVar("P")


@dataclass(frozen=True)
class SteppedLook(Generic[P]):
    """Axis, title and caption of the figure for one kind of stepped sine."""

    along: Callable[[SteppedResponse], Reals]
    axis: str
    title: Callable[[P, SteppedResponse], str]
    caption: Callable[[P, SteppedResponse], str]
    """First sentences of the caption; sentences on feedback and simulation follow."""


def stepped_sine_figure(
    analysis: SteppedSineAnalysis, overlay: SteppedSineOverlay | None, look: SteppedLook[Any]
) -> style.DrawnFigure:
    """Draw Responses I and II over the stepped quantity, with a different marker for each direction."""
    along = look.along(analysis.response)
    with style.drawing(_HEIGHT_IN) as figure:
        first, second = figure.subplots(2, 1, sharex=True)
        _responses(first, along, analysis, overlay, RESPONSE_I)
        _responses(second, along, analysis, overlay, RESPONSE_II)
        second.set_xlabel(look.axis)
        style.legend_above(figure, [first], columns=2)
    found = analysis.response
    content = columns(
        found,
        "frequency_hz direction amplitude_vpp drive_amplitude_m response_i response_ii sd_response_ii "
        "phase_rad",
    )
    if overlay is not None:
        content |= style.simulated_responses(overlay)
    name = f"stepped_sine_{analysis.facts.name}"
    caption = [look.caption(analysis.excitation, found), *feedback_sentences(analysis.facts.feedback)]
    return style.DrawnFigure(
        name=name,
        title=look.title(analysis.excitation, found),
        caption=" ".join(caption if overlay is None else [*caption, style.run_text(overlay)]),
        figure=figure,
        tables=(table(name, **content),),
    )


def _responses(
    axes: Axes, along: Reals, analysis: SteppedSineAnalysis, overlay: SteppedSineOverlay | None, what: str
) -> None:
    found, attribute = analysis.response, style.ATTRIBUTES[what]
    if overlay is not None:
        style.draw_sines(axes, along, overlay.prediction, what, "steady sines from rest")
    for direction in sorted(set(found.direction)):
        chosen = np.array([each == direction for each in found.direction])
        marker = _MARKERS.get(direction, "o")
        values = getattr(found, attribute)[chosen]
        axes.plot(along[chosen], values, marker, color=style.MEASURED, label=f"measured, {direction}")
        if overlay is not None:
            _draw_simulated(axes, along, chosen, overlay, what, (marker, direction))
    for low_hz, high_hz, _ in noted_jumps(analysis.facts.feedback):
        axes.axvspan(low_hz, high_hz, color=style.MEASURED, alpha=0.3)
    style.magnitude_axis(axes)
    axes.set_ylabel(style.RESPONSE_LABELS[what])


def _draw_simulated(
    axes: Axes, along: Reals, chosen: Flags, overlay: SteppedSineOverlay, what: str, look: tuple[str, str]
) -> None:
    """Draw the median of simulated runs at each step in one direction, with the 95 % band as error bars."""
    values, reach = getattr(overlay.response, style.ATTRIBUTES[what])[chosen], None
    found = overlay.quantity(what)
    if found is not None and overlay.run.draws > 1:
        values = found.median[chosen]
        reach = np.clip([values - found.lower[chosen], found.upper[chosen] - values], 0.0, None)
    marker, direction = look
    label = f"{style.simulated_label(overlay.run)}, {direction}"
    empty: dict[str, Any] = {"markerfacecolor": "none", "elinewidth": 0.8, "capsize": 1.5}
    axes.errorbar(along[chosen], values, reach, fmt=marker, color=style.SIMULATED, label=label, **empty)


def _frequencies_caption(plan: SteppedSine | SettledSine, found: SteppedResponse) -> str:
    """Return the caption of a stepped frequency, with the largest response and its frequency."""
    top = int(np.argmax(found.response_ii))
    return (
        f"{EXCITATION_KINDS[plan.kind].title} at {plan.amplitude_vpp:g} Vpp, {found.frequency_hz.size} "
        f"steps from {np.min(found.frequency_hz):.4g} to {np.max(found.frequency_hz):.4g} Hz. "
        f"Response II is largest at {found.frequency_hz[top]:.4g} Hz: "
        f"{plus_minus(found.response_ii[top], 2 * found.sd_response_ii[top])}."
    )


def stepped_level_caption(found: SteppedResponse) -> str:
    """Return the caption of a stepped level, with the levels of jumps and their hysteresis."""
    text = (
        f"Level stepped at {np.median(found.frequency_hz):.4g} Hz, {found.frequency_hz.size} steps from "
        f"{np.min(found.amplitude_vpp):.4g} to {np.max(found.amplitude_vpp):.4g} Vpp."
    )
    jumps = level_jumps(found)
    texts = [
        f"On the way {each.direction}, Response II changes by a factor of {each.factor:.3g} between "
        f"{each.before_vpp:.4g} and {each.after_vpp:.4g} Vpp."
        for each in jumps
    ]
    apart = hysteresis_vpp(jumps)
    if apart is not None:
        texts.append(f"The jump up is {max(apart[0], 0.0):.3g} to {apart[1]:.3g} V above the jump down.")
    return " ".join([text, *(texts or ["No jump by more than a factor of two."])])


def tracked_caption(found: SteppedResponse) -> str:
    """Return the caption of a tracked resonance, with the number of base levels."""
    return f"Resonance tracked, number of base levels: {found.frequency_hz.size}."


STEPPED_FREQUENCIES: SteppedLook[SteppedSine | SettledSine] = SteppedLook(
    along=lambda found: found.frequency_hz,
    axis="drive frequency [Hz]",
    title=lambda plan, _: f"{EXCITATION_KINDS[plan.kind].title}, {plan.amplitude_vpp:g} Vpp",
    caption=_frequencies_caption,
)
STEPPED_LEVELS: SteppedLook[SteppedLevel] = SteppedLook(
    along=lambda found: found.amplitude_vpp,
    axis="level at the generator [Vpp]",
    title=lambda plan, _: f"Stepped level, {plan.frequency_hz:g} Hz",
    caption=lambda _, found: stepped_level_caption(found),
)
TRACKED_RESONANCE: SteppedLook[ResonanceTracking] = SteppedLook(
    along=lambda found: found.frequency_hz,
    axis="drive frequency [Hz]",
    title=lambda _, found: f"Tracked resonance, around {np.median(found.frequency_hz):.4g} Hz",
    caption=lambda _, found: tracked_caption(found),
)


_BACKBONE_HEIGHT_IN = 4.2
_MARGIN = 0.15
"""Margin around the points, relative to their range, so that no point lies on the frame."""
_MOST_MARKS = 5
"""Maximum number of tick intervals on the backbone's frequency axis; labels such as 266.385 are wide."""
_COLUMNS = "base_m_per_s2 frequency_hz u_frequency_hz mode_hz u_mode_hz damping_ratio amplitude_m"
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
    # NaN at the levels without a resonance interrupts the lines there.
    nowhere = replace(levels[0], frequency_hz=np.nan, amplitude_m=np.nan, mode_hz=None, u_mode_hz=None)
    gaps = [replace(nowhere, base_m_per_s2=each) for each in lost]
    interrupted = sorted([*levels, *gaps], key=lambda each: each.base_m_per_s2)
    drawn = rows(interrupted, _COLUMNS)
    scale, unit = style.with_prefix(float(np.nanmax(drawn["amplitude_m"], initial=0.0)), "m")
    size = scale * drawn["amplitude_m"]
    with style.drawing(_BACKBONE_HEIGHT_IN) as figure:
        places = figure.subplot_mosaic([["frequency", "backbone"], ["amplitude", "backbone"]])
        frequencies, amplitudes, backbone = (places[each] for each in ("frequency", "amplitude", "backbone"))
        _frequencies(frequencies, drawn)
        amplitudes.plot(drawn["base_m_per_s2"], size, color=style.MEASURED, marker="o", linewidth=0.8)
        if simulated_m is not None:
            look: dict[str, Any] = {"color": style.SIMULATED, "markerfacecolor": "none", "label": _SIMULATED}
            amplitudes.plot(base, scale * simulated_m, "s", **look)
        amplitudes.set_xlabel(_LEVEL)
        backbone.errorbar(drawn["frequency_hz"], size, xerr=2 * drawn["u_frequency_hz"], **_MEASURED)
        backbone.xaxis.set_major_locator(MaxNLocator(_MOST_MARKS))
        what = "phase resonance" if levels[0].is_fundamental else "drive at phase resonance"
        backbone.set_xlabel(f"{what} [Hz]")
        for axes in places.values():
            axes.margins(_MARGIN)
        for axes in (amplitudes, backbone):
            highest = (1.0 + _MARGIN) * axes.dataLim.ymax
            axes.set(ylabel=f"m0 {_order_text(levels[0])} [{unit}]", ylim=(0.0, highest))
        for axes in (frequencies, amplitudes):
            for level in lost:
                axes.axvline(level, label=_LOST, **_MARK)
            axes.set_xlim(0.0, (1 + _MARGIN) * max((*base, *lost)))
        frequencies.sharex(amplitudes)
        frequencies.tick_params(labelbottom=False)
        style.legend_above(figure, [frequencies, amplitudes], columns=2)
    name = f"backbone_{analysis.facts.name}"
    columns = rows(levels, _COLUMNS)
    if simulated_m is not None:
        columns["amplitude_m_simulated"] = simulated_m
    feedback = feedback_sentences(analysis.facts.feedback)
    sentences = tracked_caption(analysis.response), backbone_sentence(levels), *feedback
    return style.DrawnFigure(
        name=name,
        title=f"Tracked resonance, around {np.median(columns['frequency_hz']):.4g} Hz",
        caption=" ".join(filter(None, sentences)),
        figure=figure,
        tables=(table(name, **columns),),
    )


def _frequencies(axes: Axes, drawn: Mapping[str, Reals]) -> None:
    base = drawn["base_m_per_s2"]
    axes.errorbar(base, drawn["frequency_hz"], 2 * drawn["u_frequency_hz"], **_MEASURED, label=_PHASE)
    if np.isfinite(drawn["mode_hz"]).any():
        axes.errorbar(
            base, drawn["mode_hz"], 2 * drawn["u_mode_hz"], color=style.PREDICTED, marker="D",
            markerfacecolor="none", linestyle="none", capsize=2, linewidth=0.8, label=_MODE,
        )  # fmt: skip
    axes.set_ylabel("frequency [Hz]")


def _order_text(level: TrackedResonance) -> str:
    """Return the order of the drive at which the amplitude was measured, for a label."""
    if level.subharmonic > 1:
        return f"at 1/{level.subharmonic} of the drive"
    return f"at {level.harmonic} times the drive" if level.harmonic > 1 else "at resonance"


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
