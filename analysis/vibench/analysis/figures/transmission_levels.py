"""Transmissions at all noise levels in one figure, to show how resonances change with the level."""

from collections.abc import Sequence

from ..frequency_response.noise_response import NoiseAnalysis
from ..frequency_response.request import MagnitudeScale
from ..recordings.facts import specimen_of
from ..tables import table
from . import style
from .ensemble_band import label_resonances, mark_resonances, model_resonances

_HEIGHT_IN = 4.0


def transmission_levels_figure(analyses: Sequence[NoiseAnalysis]) -> style.DrawnFigure:
    """Draw the transmissions of several noise levels, weak to strong; at least one is needed."""
    rising = sorted(analyses, key=lambda each: each.excitation.amplitude_vpp)
    view = rising[0].view
    at = model_resonances(specimen_of(rising[0].facts.bench))
    with style.styled():
        figure = style.new_figure(_HEIGHT_IN)
        axes = figure.subplots()
        mark_resonances(axes, at)
        for number, each in enumerate(rising):
            found = view.shown(each.response.frequency_response)
            level = each.response.base_level.rms_acceleration
            label = f"{each.excitation.amplitude_vpp:g} Vpp ({level:.2g} m/s² rms)"
            line, colour = (
                style.LEVEL_STYLES[number % len(style.LEVELS)],
                style.LEVELS[number % len(style.LEVELS)],
            )
            axes.plot(
                found.frequency_hz,
                view.drawn(found.magnitude),
                line,
                color=colour,
                linewidth=1.0,
                label=label,
            )
        if view.scale is MagnitudeScale.LOG:
            style.magnitude_axis(axes)
        axes.set_ylabel(view.label(rising[0].facts.mass))
        axes.set_xlabel("frequency [Hz]")
        lows = [float(each.response.frequency_response.frequency_hz[0]) for each in rising]
        highs = [float(each.response.frequency_response.frequency_hz[-1]) for each in rising]
        style.frequency_axis(axes, min(lows), max(highs))
        label_resonances(axes, at)
        style.legend_above(figure, [axes], columns=2)
    columns = {}
    for each in rising:
        columns[f"frequency_hz_{each.facts.name}"] = each.response.frequency_response.frequency_hz
        columns[f"magnitude_{each.facts.name}"] = view.shown(each.response.frequency_response).magnitude
    return style.DrawnFigure(
        name="transmission_levels",
        title=f"{view.title} at all noise levels",
        caption=transmission_levels_caption(rising),
        figure=figure,
        tables=(table("transmission_levels", **columns),),
    )


def transmission_levels_caption(rising: Sequence[NoiseAnalysis]) -> str:
    """Return the caption with the resonances at each level."""
    levels = []
    for each in rising:
        peaks = [f"{found.frequency_hz:.0f}" for found in each.response.resonances]
        where = f"resonances at {', '.join(peaks)} Hz" if peaks else "no clear resonance"
        levels.append(f"{each.excitation.amplitude_vpp:g} Vpp: {where}")
    return (
        f"Measured {rising[0].view.symbol} of {rising[0].facts.response} at {len(rising)} noise levels. "
        f"{'; '.join(levels)}. Dashed: resonances of the model without contact; dotted: with m1 stuck to "
        "m2, where strong collisions move the motion to."
    )
