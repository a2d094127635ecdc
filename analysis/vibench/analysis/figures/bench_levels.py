"""Figure of the smallest and largest values of every channel, from the bench check to the last ramp."""

from ..recordings.channel_levels import ChannelLevel
from ..recordings.facts import RecordingFacts
from ..tables import table
from . import style

_ROW_IN = 0.85
_FRAME_IN = 0.6
_UNITS = {"m s-1": "m/s", "m s-2": "m/s²"}
"""Readable forms of units that files state in UDUNITS notation."""


def bench_levels_figure(facts: RecordingFacts) -> style.DrawnFigure:
    """Draw the smallest and largest values of every channel over the whole recording."""
    with style.figure_style():
        figure = style.new_figure(_FRAME_IN + _ROW_IN * len(facts.channels))
        panels = figure.subplots(len(facts.channels), 1, sharex=True, squeeze=False)[:, 0]
        for axes, level in zip(panels, facts.channels, strict=True):
            factor, unit = style.with_prefix(level.peak, _UNITS.get(level.header.unit, level.header.unit))
            shape = level.envelope
            axes.fill_between(
                shape.time_s, factor * shape.lower, factor * shape.upper, color=style.MEASURED, linewidth=0.3
            )
            role = style.plain_label(level.header.role).replace("_", "\n")
            axes.set_ylabel(f"{role}\n[{style.plain_label(unit)}]", fontsize=7.5)
        panels[-1].set(xlabel="time since the first sample [s]", xlim=(0, facts.duration_s))
        figure.align_ylabels()
    columns = {"time_s": facts.channels[0].envelope.time_s}
    for level in facts.channels:
        columns[f"{level.header.role}_lower"] = level.envelope.lower
        columns[f"{level.header.role}_upper"] = level.envelope.upper
    parts = [f"{_peak(each)} ({100 * each.share_of_range:.2g} % of its range)" for each in facts.channels]
    return style.DrawnFigure(
        name=f"levels_{facts.name}",
        title="Levels of all channels",
        caption=f"Extremes of every channel, including ramps and waits. Peaks: {', '.join(parts)}.",
        figure=figure,
        tables=(table(f"levels_{facts.name}", **columns),),
    )


def _peak(level: ChannelLevel) -> str:
    factor, unit = style.with_prefix(level.peak, _UNITS.get(level.header.unit, level.header.unit))
    return f"{level.header.role.replace('_', ' ')} {factor * level.peak:.3g} {unit}"
