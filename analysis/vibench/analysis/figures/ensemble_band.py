"""Median and 95 % band of simulated runs (draws), for figures, tables and captions."""

from collections.abc import Callable
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from vibench.sim import Specimen

from ..overlay.draws import SimulatedRun
from ..overlay.overlay import (
    RESPONSE_I,
    RESPONSE_II,
    AbstractOverlay,
    ResponsePrediction,
    SteppedSineOverlay,
    SweepOverlay,
)
from ..signals.arrays import Reals
from ..tables import Table, columns, table
from . import style

ATTRIBUTES = {RESPONSE_I: "response_i", RESPONSE_II: "response_ii"}
"""Names of the attributes in which a result stores its responses to sines, keyed by response."""
RESPONSE_LABELS = {RESPONSE_I: "Response I\nmax |x| / A0", RESPONSE_II: "Response II\n|x at f| / A0"}


def draw_sines(axes: Axes, along: Reals, sines: ResponsePrediction, what: str, label: str) -> None:
    """Draw the response without contact as a line, and responses to steady sines as dots, over ``along``."""
    rising = np.argsort(along)
    axes.plot(along[rising], sines.linear[rising], **style.LINEAR_CURVE)
    axes.plot(along, getattr(sines, ATTRIBUTES[what]), ".", color=style.PREDICTED, label=label)


def simulated_label(run: SimulatedRun) -> str:
    """Return the legend label of the simulated curve."""
    if not run.driven.by_voltage:
        return "simulated from the recorded base motion"
    return "simulated from the recorded voltage"


def draw_band(
    axes: Axes,
    along: Reals,
    overlay: AbstractOverlay[Any],
    name: str,
    shown: Callable[[Reals], Reals] = lambda values: values,
) -> Reals | None:
    """Draw the 95 % band of one quantity as an area, and return its median; None without several draws.

    ``along`` contains the abscissae of the quantity; ``shown`` converts the quantity's values to axis values.
    """
    found = overlay.quantity(name)
    if found is None or overlay.run.draws == 1:
        return None
    # The number of draws differs between recordings: the caption states the number, the label does not.
    look: dict[str, Any] = {"color": style.SIMULATED, "alpha": 0.25, "zorder": 1.5, "label": "95 % of draws"}
    axes.fill_between(along, shown(found.lower), shown(found.upper), **look)
    return shown(found.median)


def run_text(overlay: AbstractOverlay[Any]) -> str:
    """Return sentences on the simulation, and on the position of the measurement among the simulated runs."""
    run = overlay.run
    if not run.driven.by_voltage:
        why = f" ({run.why})" if run.why else ""
        return (
            f"Simulated from the recorded base motion{why}, {run.impact_rate_hz:.0f} impacts per second: "
            f"median difference {overlay.difference.median_abs_db:.2g} dB, "
            f"{100 * overlay.difference.share_within_two:.0f} % of the values within two standard errors. "
            "Simulated impacts do not move the recorded base, so simulated chaos differs from measured chaos."
        )
    parts = [
        (
            f"Rig and specimen simulated together from the {run.driven.value}, {run.draws} draws from "
            f"slightly different initial states, {run.impact_rate_hz:.0f} impacts per second"
        ),
        *overlay.agreement,
    ]
    ending = [] if overlay.escape is None else [overlay.escape.sentence]
    known = [run.why] if run.why else []
    return ". ".join(["; ".join(parts), *ending, *known]) + "."


def agreement_text(overlay: AbstractOverlay[Any]) -> str:
    """Return the end of a sentence: agreement and escape rate; empty if base motion drives the simulation."""
    if not overlay.run.driven.by_voltage:
        return ""
    parts = [*overlay.agreement]
    if overlay.escape is not None:
        parts.append(overlay.escape.sentence)
    return "".join(f"; {each}" for each in parts)


def sines_table(name: str, sines: ResponsePrediction) -> Table:
    """Return a table of the responses to steady sines."""
    keys = "frequency_hz amplitude_m response_i response_ii linear impacts"
    return table(f"{name}_sines", **columns(sines, keys))


def band_columns(overlay: AbstractOverlay[Any], name: str, column: str) -> dict[str, Reals]:
    """Return columns with median, band, z and rank of a simulated quantity; empty without several draws."""
    found = overlay.quantity(name)
    if found is None or overlay.run.draws == 1:
        return {}
    return {
        f"{column}_draws_median": found.median,
        f"{column}_draws_lower": found.lower,
        f"{column}_draws_upper": found.upper,
        f"{column}_z": found.z,
        f"{column}_rank": found.rank.astype(np.float64),
    }


def simulated_responses(overlay: SweepOverlay | SteppedSineOverlay) -> dict[str, Reals]:
    """Return table columns of simulated responses to sines, with median and band of the simulated runs."""
    return {
        **columns(overlay.response, "response_i_simulated=response_i response_ii_simulated=response_ii"),
        **band_columns(overlay, RESPONSE_I, "response_i"),
        **band_columns(overlay, RESPONSE_II, "response_ii"),
    }


_LABEL_HEIGHT = 1.01
"""Height of frequency labels just above the panel, relative to the panel height."""
_FREE_LABEL = "resonances without contact"
_BOUND_LABEL = "terminal resonances (m1 stuck to m2)"


def mark_resonances(axes: Axes, of: Specimen, *, without_contact: bool = True) -> None:
    """Draw dashed lines at resonances without contact, and dotted lines at those with m1 stuck to m2."""
    look: dict[str, Any] = {"linestyle": "--", "linewidth": 0.8, "label": _FREE_LABEL, "zorder": 1}
    for frequency in of.natural_frequencies_hz if without_contact else ():
        axes.axvline(frequency, color=style.BOUNDS, **look)
    look |= {"linestyle": ":", "linewidth": 1.0, "label": _BOUND_LABEL}
    for frequency in of.bound_frequencies_hz:
        axes.axvline(frequency, color=style.TERMINAL, **look)


def label_resonances(axes: Axes, of: Specimen, *, without_contact: bool = True) -> None:
    """Write the frequencies of the resonances above the panel."""
    low, high = axes.get_xlim()
    place: dict[str, Any] = {"transform": axes.get_xaxis_transform(), "ha": "center", "va": "bottom"}
    free_hz = of.natural_frequencies_hz if without_contact else ()
    for frequencies_hz, colour in ((free_hz, "#555555"), (of.bound_frequencies_hz, style.TERMINAL)):
        for frequency in frequencies_hz:
            if low <= frequency <= high:
                axes.text(frequency, _LABEL_HEIGHT, f"{frequency:.0f}", fontsize=7, color=colour, **place)
