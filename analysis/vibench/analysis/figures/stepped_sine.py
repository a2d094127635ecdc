"""Figure of Responses I and II at each frequency or level of a stepped sine, for steps up and down."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

import numpy as np
from matplotlib.axes import Axes

from vibench.acquisition.plan import (
    EXCITATION_KINDS,
    ResonanceTracking,
    SettledSine,
    SteppedLevel,
    SteppedSine,
)

from ..overlay.overlay import RESPONSE_I, RESPONSE_II, SteppedSineOverlay
from ..signals.arrays import Flags, Reals
from ..sine.jumps import hysteresis_vpp, level_jumps
from ..sine.stepped_response import SteppedResponse, SteppedSineAnalysis, feedback_sentences, noted_jumps
from ..tables import columns, plus_minus, table
from . import style
from .ensemble_band import (
    ATTRIBUTES,
    RESPONSE_LABELS,
    draw_sines,
    run_text,
    simulated_label,
    simulated_responses,
)

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
    with style.figure_style():
        figure = style.new_figure(_HEIGHT_IN)
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
        content |= simulated_responses(overlay)
    name = f"stepped_sine_{analysis.facts.name}"
    return style.DrawnFigure(
        name=name,
        title=look.title(analysis.excitation, found),
        caption=_caption(analysis, overlay, look),
        figure=figure,
        tables=(table(name, **content),),
    )


def _responses(
    axes: Axes, along: Reals, analysis: SteppedSineAnalysis, overlay: SteppedSineOverlay | None, what: str
) -> None:
    found, attribute = analysis.response, ATTRIBUTES[what]
    if overlay is not None:
        draw_sines(axes, along, overlay.prediction, what, "steady sines from rest")
    for direction in sorted(set(found.direction)):
        chosen = np.array([each == direction for each in found.direction])
        marker = _MARKERS.get(direction, "o")
        values = getattr(found, attribute)[chosen]
        axes.plot(along[chosen], values, marker, color=style.MEASURED, label=f"measured, {direction}")
        if overlay is not None:
            _draw_simulated(axes, along, chosen, overlay, what, (marker, direction))
    for jump in noted_jumps(analysis.facts.feedback):
        axes.axvspan(jump.low_hz, jump.high_hz, color=style.MEASURED, alpha=0.3)
    style.magnitude_axis(axes)
    axes.set_ylabel(RESPONSE_LABELS[what])


def _draw_simulated(
    axes: Axes, along: Reals, chosen: Flags, overlay: SteppedSineOverlay, what: str, look: tuple[str, str]
) -> None:
    """Draw the median of simulated runs at each step in one direction, with the 95 % band as error bars."""
    values, reach = getattr(overlay.response, ATTRIBUTES[what])[chosen], None
    found = overlay.quantity(what)
    if found is not None and overlay.run.draws > 1:
        values = found.median[chosen]
        reach = np.clip([values - found.lower[chosen], found.upper[chosen] - values], 0.0, None)
    marker, direction = look
    label = f"{simulated_label(overlay.run)}, {direction}"
    empty: dict[str, Any] = {"markerfacecolor": "none", "elinewidth": 0.8, "capsize": 1.5}
    axes.errorbar(along[chosen], values, reach, fmt=marker, color=style.SIMULATED, label=label, **empty)


def _caption(
    analysis: SteppedSineAnalysis, overlay: SteppedSineOverlay | None, look: SteppedLook[Any]
) -> str:
    """Return the caption, with the agreement of the simulation if there is one."""
    text = look.caption(analysis.excitation, analysis.response)
    text = " ".join([text, *feedback_sentences(analysis.facts.feedback)])
    if overlay is None:
        return text
    return f"{text} {run_text(overlay)}"


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
