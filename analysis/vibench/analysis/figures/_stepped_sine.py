"""Responses I and II at every frequency, or every level, of a stepped sine, up and down apart."""

import numpy as np
from matplotlib.axes import Axes

from vibench.acquisition.plan import ResonanceTracking, SteppedLevel

from ..model import SteppedSineOverlay
from ..signals import Reals
from ..sine import SteppedSineAnalysis, feedback_sentences, hysteresis_vpp, level_jumps, noted_jumps
from ..tables import table
from ._drawn import DrawnFigure
from ._style import LINEAR, MEASURED, PREDICTED, SIMULATED, legend_above, magnitude_axis, new_figure, styled

_HEIGHT_IN = 4.6
_MARKERS = {"up": "^", "down": "v"}


def stepped_sine_figure(analysis: SteppedSineAnalysis, laid: SteppedSineOverlay | None = None) -> DrawnFigure:
    """Draw Response I and II against frequency or level, one marker a direction."""
    with styled():
        figure = new_figure(_HEIGHT_IN)
        first, second = figure.subplots(2, 1, sharex=True)
        _responses(first, analysis, laid, "response_i")
        _responses(second, analysis, laid, "response_ii")
        first.set_ylabel("Response I\nmax |x| / A0")
        second.set_ylabel("Response II\n|x at f| / A0")
        second.set_xlabel(_along(analysis)[1])
        legend_above(figure, [first], columns=2)
    found = analysis.response
    columns = {
        "frequency_hz": found.frequency_hz,
        "direction": np.asarray(found.direction),
        "amplitude_vpp": found.amplitude_vpp,
        "drive_amplitude_m": found.drive_amplitude_m,
        "response_i": found.response_i,
        "response_ii": found.response_ii,
        "sd_response_ii": found.sd_response_ii,
        "phase_rad": found.phase_rad,
    }
    if laid is not None:
        columns["response_i_simulated"] = laid.response.response_i
        columns["response_ii_simulated"] = laid.response.response_ii
    name = f"stepped_sine_{analysis.facts.name}"
    return DrawnFigure(
        name=name,
        title=_title(analysis),
        caption=stepped_sine_caption(analysis, laid),
        figure=figure,
        tables=(table(name, **columns),),
    )


def _along(analysis: SteppedSineAnalysis) -> tuple[Reals, str]:
    """Give what was stepped, and what its axis is called."""
    match analysis.excitation:
        case SteppedLevel():
            return analysis.response.amplitude_vpp, "level at the generator [Vpp]"
        case _:
            return analysis.response.frequency_hz, "drive frequency [Hz]"


def _title(analysis: SteppedSineAnalysis) -> str:
    match analysis.excitation:
        case SteppedLevel(frequency_hz=frequency_hz):
            return f"Stepped level, {frequency_hz:g} Hz"
        case ResonanceTracking():
            return f"Tracked resonance, around {np.median(analysis.response.frequency_hz):.4g} Hz"
        case plan:
            return f"Stepped sine, {plan.amplitude_vpp:g} Vpp"


def _responses(axes: Axes, analysis: SteppedSineAnalysis, laid: SteppedSineOverlay | None, what: str) -> None:
    found = analysis.response
    along, _ = _along(analysis)
    rising = np.argsort(along)
    if laid is not None:
        sines = laid.prediction
        axes.plot(
            along[rising],
            sines.linear[rising],
            color=LINEAR,
            linestyle="--",
            label="without contact",
        )
        axes.plot(
            along,
            getattr(sines, what),
            color=PREDICTED,
            linestyle="none",
            marker=".",
            markersize=4,
            label="steady sines from rest",
        )
    for direction in sorted(set(found.direction)):
        chosen = np.array([each == direction for each in found.direction])
        marker = _MARKERS.get(direction, "o")
        axes.plot(
            along[chosen],
            getattr(found, what)[chosen],
            color=MEASURED,
            label=f"measured, {direction}",
            linestyle="none",
            marker=marker,
            markersize=4,
        )
        if laid is not None:
            axes.plot(
                along[chosen],
                getattr(laid.response, what)[chosen],
                color=SIMULATED,
                markerfacecolor="none",
                label=f"simulated under the recorded base, {direction}",
                linestyle="none",
                marker=marker,
                markersize=4,
            )
    for jump in noted_jumps(analysis.facts.feedback):
        axes.axvspan(jump.low_hz, jump.high_hz, color=MEASURED, alpha=0.3, linewidth=0)
    magnitude_axis(axes)


def stepped_sine_caption(analysis: SteppedSineAnalysis, laid: SteppedSineOverlay | None) -> str:
    """Say where the largest response was, and how far the simulation lies from it."""
    found = analysis.response
    top = int(np.argmax(found.response_ii))
    text = (
        f"Stepped sine at {analysis.excitation.amplitude_vpp:g} Vpp, {found.frequency_hz.size} steps from "
        f"{np.min(found.frequency_hz):.4g} to {np.max(found.frequency_hz):.4g} Hz. Response II is largest "
        f"at {found.frequency_hz[top]:.4g} Hz: {found.response_ii[top]:.3g} ± "
        f"{2 * found.sd_response_ii[top]:.2g}."
    )
    match analysis.excitation:
        case SteppedLevel():
            text = stepped_level_caption(analysis)
        case ResonanceTracking():
            text = f"Resonance tracked, levels of the base: {found.frequency_hz.size}."
        case _:
            pass
    text = " ".join([text, *feedback_sentences(analysis.facts.feedback)])
    if laid is None:
        return text
    return (
        f"{text} Simulated under the recorded base motion: median difference "
        f"{laid.difference.median_abs_db:.2g} dB, {100 * laid.difference.share_within_two:.0f} % of the "
        f"steps within two standard errors, {laid.run.impacts} impacts within the steps."
    )


def stepped_level_caption(analysis: SteppedSineAnalysis) -> str:
    """Say between which levels the motion jumps, and how far apart the two ways lie."""
    found = analysis.response
    text = (
        f"Level stepped at {np.median(found.frequency_hz):.4g} Hz, {found.frequency_hz.size} steps from "
        f"{np.min(found.amplitude_vpp):.4g} to {np.max(found.amplitude_vpp):.4g} Vpp."
    )
    jumps = level_jumps(found)
    told = [
        f"Going {each.direction}, Response II changes by a factor of {each.factor:.3g} between "
        f"{each.before_vpp:.4g} and {each.after_vpp:.4g} Vpp."
        for each in jumps
    ]
    apart = hysteresis_vpp(jumps)
    if apart is not None:
        told.append(f"The jump up lies {max(apart[0], 0.0):.3g} to {apart[1]:.3g} V above the fall back.")
    return " ".join([text, *(told or ["No jump by more than a factor of two."])])
