"""Figure of sweeps up and down, which shows where the response depends on the direction."""

import numpy as np

from ..sine.jumps import Jump, hysteresis
from ..sine.sweep_analysis import SweepAnalysis
from ..tables import columns, table
from . import style

_HEIGHT_IN = 3.4


def hysteresis_figure(up: SweepAnalysis, down: SweepAnalysis) -> style.DrawnFigure:
    """Draw Response II of both sweeps, the jumps, and the bands in which the sweeps differ."""
    found = hysteresis(up.response, down.response, up.jumps, down.jumps)
    with style.figure_style():
        figure = style.new_figure(_HEIGHT_IN)
        axes = figure.subplots()
        axes.fill_between(
            found.frequency_hz,
            0,
            1,
            where=found.differs.tolist(),
            transform=axes.get_xaxis_transform(),
            color=style.COLLIDING,
            label="the sweeps differ",
        )
        for curve, jumps, colour, line, label in (
            (found.up, up.jumps, style.LEVELS[0], "-", "up"),
            (found.down, down.jumps, style.LEVELS[2], "--", "down"),
        ):
            axes.plot(found.frequency_hz, curve, color=colour, linestyle=line, label=f"sweep {label}")
            for jump in jumps:
                axes.axvspan(jump.lower_hz, jump.upper_hz, color=colour, alpha=0.4, linewidth=0.5)
        style.magnitude_axis(axes)
        axes.set(
            xlim=(float(found.frequency_hz[0]), float(found.frequency_hz[-1])),
            xlabel="drive frequency [Hz]",
            ylabel="Response II\n|x at f| / A0",
        )
        style.legend_above(figure, [axes])
    name = f"hysteresis_{up.facts.name}_{down.facts.name}"
    content = columns(found, "frequency_hz response_ii_up=up response_ii_down=down")
    widths = "; ".join(
        f"hysteresis {width:.1f} Hz wide ({low:.1f} to {high:.1f})" for width, low, high in found.widths_hz
    )
    share = float(np.mean(found.differs))
    return style.DrawnFigure(
        name=name,
        title=f"Sweeps up and down, {up.excitation.amplitude_vpp:g} Vpp",
        caption=f"Response II of sweeps up and down at {up.excitation.amplitude_vpp:g} Vpp. "
        f"Up: {jumps_text(up.jumps)}. Down: {jumps_text(down.jumps)}. {widths + '. ' if widths else ''}"
        f"Grey: the sweeps differ by more than 1.5 dB ({100 * share:.0f} % of the band).",
        figure=figure,
        tables=(table(name, **content, differs=found.differs.astype(np.int64)),),
    )


def jumps_text(jumps: tuple[Jump, ...]) -> str:
    """Return jumps of a response, with the bounds of their frequencies, as text."""
    if not jumps:
        return "no jump"
    return " and ".join(
        f"a jump of {each.decibel:+.1f} dB at {each.frequency_hz:.1f} Hz ({each.lower_hz:.1f} to "
        f"{each.upper_hz:.1f})"
        for each in jumps
    )
