"""Contact force over relative displacement, one panel for each contact law."""

import re
from collections.abc import Mapping
from itertools import zip_longest

import numpy as np
from matplotlib.axes import Axes

from vibench.sim import PowerLaw, RigidStops, Specimen, spring_of

from ..signals.arrays import Reals
from ..tables import Table, table
from . import style

_COLUMNS = 3
_BEFORE_M, _BEYOND_M = 2e-6, 1.5e-6
"""Range of p on both sides of a stop; power laws begin at -gap. The paper fits up to 1 um beyond the stop."""
_GREY = "#9a9a9a"
_SPEED_M_PER_S = 0.1
"""Speed for laws that depend on it: the impact speed of the paper's specimen at 5 um and 260 Hz."""
_POINTS = 801


def contact_forces_figure(specimens: Mapping[str, Specimen]) -> style.DrawnFigure:
    """Draw the force that pushes m1 back over p = y - z, in one panel per specimen, titled by its label.

    The nearer stop is shown. A law that depends on the speed is drawn for loading and unloading at
    0.1 m/s. Rigid stops, which have no finite force, are drawn as a wall.
    """
    rows = -(-len(specimens) // _COLUMNS)
    tables = []
    with style.styled():
        figure = style.new_figure(0.6 + 2.1 * rows)
        panels = figure.subplots(rows, min(_COLUMNS, len(specimens)), squeeze=False).flat
        for axes, named in zip_longest(panels, specimens.items()):
            if named is None:
                axes.set_visible(False)
                continue
            tables += _draw(axes, *named)
    return style.DrawnFigure(
        name="contact_forces",
        title="Forces of the contact laws",
        caption=(
            "Force that pushes m1 back from its stop (grey) over p = y - z; at the other stop it has the "
            f"other sign. A law with a loss is shown at {_SPEED_M_PER_S:g} m/s, pressed in (solid) and let "
            "go (dashed)."
        ),
        figure=figure,
        tables=tuple(tables),
    )


def _draw(axes: Axes, label: str, specimen: Specimen) -> list[Table]:
    below_m, above_m = specimen.gaps_m
    nearer_m = min(below_m, above_m)
    first_m = -nearer_m if isinstance(specimen.contact, PowerLaw) else nearer_m - _BEFORE_M
    # Go from free motion into the nearer stop; `side` is the sign of p there.
    side = -1.0 if below_m < above_m else 1.0
    stop_m, p = side * nearer_m, side * np.linspace(first_m, nearer_m + _BEYOND_M, _POINTS)
    axes.axvline(1e6 * stop_m, color=_GREY, linewidth=0.8)
    axes.set_title(label, fontsize="small")
    axes.set_xlabel("p [µm]")
    axes.set_ylabel("force [N]")
    if isinstance(specimen.contact, RigidStops):
        axes.plot([1e6 * p[0], 1e6 * stop_m, 1e6 * stop_m], [0.0, 0.0, side], color=style.MEASURED)
        axes.axvspan(1e6 * stop_m, 1e6 * p[-1], color=_GREY, alpha=0.3)
        axes.set_ylim(min(-0.1 * side, side), max(-0.1 * side, side))
        axes.set_yticks([0.0])
        return []
    pressed, let_go = (_force(specimen, p, side * each) for each in (_SPEED_M_PER_S, -_SPEED_M_PER_S))
    axes.plot(1e6 * p, pressed, color=style.MEASURED)
    if not np.array_equal(pressed, let_go):
        axes.plot(1e6 * p, let_go, color=style.SIMULATED, linestyle="--")
    name = re.sub(r"\W+", "_", label).strip("_")
    return [table(f"contact_forces_{name}", p_m=p, pressed_n=pressed, let_go_n=let_go)]


def _force(specimen: Specimen, p: Reals, speed: float) -> Reals:
    # Adding zero turns "-0" into "0" in tables.
    return np.asarray(spring_of(specimen).force(p, np.full_like(p, speed))) + 0.0
