"""Figures of the motion estimated from one recording: p = y - z between the stops, and the impacts."""

import numpy as np
from matplotlib.axes import Axes

from ..hidden_motion import Hidden, HiddenMotion, measured_gaps
from ..signals import envelope
from ..tables import Table, columns, table
from . import _style as style

_MICRO = 1e6
_COLUMNS = 1200
_ZOOM_S = 0.025
_BOUND = 1.96
"""Half width of a 95 % interval in standard deviations."""
_BINS = 40
_DEEPEST_SHOWN_M = 2e-6
_POINTS = 200


def hidden_motion_figure(motion: HiddenMotion) -> style.DrawnFigure:
    """Draw p between the stops over the whole analysed part of the recording, and enlarged over a few ms."""
    with style.drawing(4.4) as figure:
        whole, zoom = figure.subplots(2, 1)
        _whole(whole, motion)
        tables = _zoom(zoom, motion)
        style.legend_above(figure, [zoom, whole], columns=4)
        figure.align_ylabels([whole, zoom])
    return style.DrawnFigure(
        name=f"hidden_motion_{motion.name}",
        title=f"Hidden motion of {motion.name}",
        caption=(
            "Relative displacement p = y - z of m1, estimated from base acceleration and m0's velocity. "
            "Above: extremes of p, grey where p was not tracked. Below: "
            f"{1e3 * _ZOOM_S:g} ms with impacts, tracked with 95 % bounds, and without a contact model. "
            + " ".join(motion.sentences)
        ),
        figure=figure,
        tables=tables,
    )


def _stops(axes: Axes, motion: HiddenMotion) -> None:
    lower, upper = motion.gaps_m
    for level in (-lower, upper):
        if np.isfinite(level):
            axes.axhline(_MICRO * level, color=style.SIMULATED, linewidth=0.9, label="stops")
    axes.set_ylabel("p [µm]")


def _whole(axes: Axes, motion: HiddenMotion) -> None:
    rate = motion.sample_rate_hz
    for gone in motion.tracked.not_followed:
        first, last = (motion.first_sample + each for each in (gone.first, gone.stop))
        axes.axvspan(first / rate, last / rate, color=style.COLLIDING, label="not followed")
    shape = envelope(motion.tracked.p, rate, bins=_COLUMNS, start_s=motion.first_sample / rate)
    axes.fill_between(shape.time_s, _MICRO * shape.lower, _MICRO * shape.upper, color=style.MEASURED)
    _stops(axes, motion)
    axes.set(xlim=(motion.time_s[0], motion.time_s[-1]), xlabel="time [s]")


def _zoom(axes: Axes, motion: HiddenMotion) -> tuple[Table, ...]:
    # Enlarge the part around the middle impact. If there are no impacts, enlarge the middle of the motion.
    count = round(_ZOOM_S * motion.sample_rate_hz)
    impacts = motion.tracked.collisions.samples
    middle = int(np.median(impacts)) if impacts.size else motion.tracked.p.size // 2
    start = min(max(0, middle - count // 2), max(0, motion.tracked.p.size - count))
    place = slice(start, start + count)
    time_s, p, sd = motion.time_s[place], motion.tracked.p[place], motion.tracked.p_sd[place]
    free = motion.free.p[place]
    low, high = _MICRO * (p - _BOUND * sd), _MICRO * (p + _BOUND * sd)
    axes.fill_between(time_s, low, high, color=style.BOUNDS, label="bounds of 95 %")
    axes.plot(time_s, _MICRO * p, color=style.MEASURED, linewidth=1.1, label="tracked")
    axes.plot(time_s, _MICRO * free, color=style.PREDICTED, linestyle=":", label="without a contact model")
    _stops(axes, motion)
    if time_s.size:
        axes.set_xlim(time_s[0], time_s[-1])
    axes.set_xlabel("time [s]")
    found = {"time_s": time_s, "p_m": p, "p_sd_m": sd, "p_without_contact_model_m": free}
    return (table(f"hidden_motion_{motion.name}", **found),)


def hidden_impacts_figure(motion: HiddenMotion) -> style.DrawnFigure:
    """Draw impulses over time, force over penetration, energy lost at each impact, and measured gaps."""
    with style.drawing(5.2) as figure:
        (impulses, force), (energy, gaps) = figure.subplots(2, 2)
        _impulses(impulses, motion)
        law = _force(force, motion)
        _energy(energy, motion)
        _gaps(gaps, motion)
    return style.DrawnFigure(
        name=f"hidden_impacts_{motion.name}",
        title=f"Collisions of {motion.name}",
        caption=(
            "Above left: impulse of every impact on m1 (dots: tracked; crosses: no contact model). Above "
            "right: force of a stop over penetration from tracking, with 95 % bounds where determined. "
            "Below left: share of the energy of relative motion that each impact dissipated, estimated "
            "without a contact model. Below right: gap from each impact without a contact model, and the "
            "gaps used for tracking (orange)."
        ),
        figure=figure,
        tables=(*_impact_tables(motion), *law),
    )


def _impulses(axes: Axes, motion: HiddenMotion) -> None:
    found, free = motion.tracked.collisions, motion.free.impacts
    largest = max([*found.impulses, *free.impulses], default=1.0)
    factor, unit = style.with_prefix(largest, "N s")
    for impacts, mark, color in ((found, ".", style.MEASURED), (free, "x", style.PREDICTED)):
        time_s = (motion.first_sample + impacts.samples) / motion.sample_rate_hz
        axes.plot(time_s, factor * impacts.impulses, mark, color=color, markersize=2.0, rasterized=True)
    axes.set(xlabel="time [s]", ylabel=f"impulse [{unit}]")


def _force(axes: Axes, motion: HiddenMotion) -> tuple[Table, ...]:
    found = {each.what: each for each in motion.parameters}
    tracked = motion.specimen
    depth = np.linspace(0.0, _DEEPEST_SHOWN_M, _POINTS)
    force = tracked.steepness * depth**tracked.exponent
    axes.plot(_MICRO * depth, force, color=style.MEASURED)
    axes.set(xlabel="penetration [µm]", ylabel="force [N]")
    at_1um, exponent = found.get(Hidden.FORCE), found.get(Hidden.EXPONENT)
    is_determined = at_1um is not None and exponent is not None and at_1um.is_determined
    if not is_determined or at_1um is None or exponent is None:
        axes.set_title("as described (not determined by this motion)", fontsize="small")
        return (table(f"hidden_force_{motion.name}", penetration_m=depth, force_n=force),)
    # Draw the envelope of all force laws with both parameters within their bounds.
    exponents = (exponent.low, exponent.high) if exponent.is_determined else (exponent.described,) * 2
    laws = np.stack([f * (_MICRO * depth) ** n for f in (at_1um.low, at_1um.high) for n in exponents])
    low, high = np.asarray(laws.min(axis=0)), np.asarray(laws.max(axis=0))
    axes.fill_between(_MICRO * depth, low, high, color=style.BOUNDS, alpha=0.5)
    return (table(f"hidden_force_{motion.name}", penetration_m=depth, force_n=force, low_n=low, high_n=high),)


def _energy(axes: Axes, motion: HiddenMotion) -> None:
    free = motion.free.impacts
    share = 1.0 - (free.rate_after / free.rate_before) ** 2
    good = (free.rate_before > 0) & (np.abs(share) < 1.0)
    axes.plot(
        free.rate_before[good], 100 * share[good], ".", color=style.PREDICTED, markersize=2.0, rasterized=True
    )
    axes.axhline(0.0, color=style.BOUNDS, linewidth=0.8)
    if good.any():
        axes.axhline(100 * float(np.median(share[good])), color=style.MEASURED, linewidth=1.0)
    axes.set(xlabel="speed of approach [m/s]", ylabel="energy lost [%]")


def _gaps(axes: Axes, motion: HiddenMotion) -> None:
    free, measured = motion.free.impacts, measured_gaps(motion.free.impacts)
    for side, label, color in ((-1.0, "lower", style.PREDICTED), (1.0, "upper", style.MEASURED)):
        here = measured[(free.sides == side) & ~np.isnan(measured)]
        if here.size:
            axes.hist(_MICRO * here, bins=_BINS, histtype="step", linewidth=1.0, color=color, label=label)
    for gap, dashes in zip(motion.gaps_m, ("--", "-"), strict=True):
        if np.isfinite(gap):
            axes.axvline(_MICRO * gap, color=style.SIMULATED, linestyle=dashes, linewidth=1.0)
    axes.set(xlabel="gap [µm]", ylabel="impacts")
    if axes.get_legend_handles_labels()[0]:
        axes.legend(fontsize="small")


def _impact_tables(motion: HiddenMotion) -> tuple[Table, ...]:
    found, free = motion.tracked.collisions, motion.free.impacts
    return (
        table(
            f"hidden_impacts_{motion.name}",
            time_s=(motion.first_sample + found.samples) / motion.sample_rate_hz,
            **columns(
                found,
                "side=sides duration_s=durations_s impulse_ns=impulses penetration_m=penetrations_m "
                "speed_before_m_per_s=speeds_before speed_after_m_per_s=speeds_after",
            ),
        ),
        table(
            f"hidden_impacts_without_contact_model_{motion.name}",
            middle_s=(motion.first_sample + free.samples) / motion.sample_rate_hz,
            **columns(free, "side=sides impulse_ns=impulses p_m=p"),
            gap_m=measured_gaps(free),
            **columns(free, "speed_before_m_per_s=rate_before speed_after_m_per_s=rate_after"),
        ),
    )
