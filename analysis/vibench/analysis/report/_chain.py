"""Figure of a chain: waves, transmission to each cell, motion over cell and time, energies."""

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from ..dynamics import ChainAnswer, ChainDrive, ChainRun
from ..tables import Table, rows, table
from . import _style as style

_WAVES_IN, _RUNS_IN = 4.2, 9.0
"""Height [inches] of the figure without runs and with runs."""
_SMALLEST = 1e-8
"""Smallest transmission drawn; smaller transmissions are drawn at this value."""
_DECADES = 4.0
"""Number of decades shown below the largest motion."""
_NOTHING = 1e-300
"""Value that replaces zero motion on a logarithmic scale."""


def chain_figure(found: ChainAnswer) -> style.DrawnFigure:
    """Draw waves and transmission; if there are runs, also motion, energies and impacts of the last run."""
    last = found.shown_run
    with style.drawing(_WAVES_IN if last is None else _RUNS_IN) as figure:
        if last is None:
            waves, across = figure.subplots(2, 1, sharex=True)
        else:
            grid = figure.add_gridspec(4, 2, height_ratios=(1.0, 1.3, 1.5, 1.0))
            waves = figure.add_subplot(grid[0, :])
            across = figure.add_subplot(grid[1, :], sharex=waves)
            _map(figure, figure.add_subplot(grid[2, :]), found, last)
            _per_cell(figure.add_subplot(grid[3, 0]), figure.add_subplot(grid[3, 1]), last)
        _waves(waves, found)
        _draw_cells(across, found)
        style.legend_above(figure, [waves, across], columns=4)
    caption = (
        "Above: phase and decay per unit of the infinite chain without contact; grey: band gaps. Below: "
        "transmission from the base to m0 of each cell, without contact and as driven."
    )
    if last is not None:
        what = "x of m0" if found.request.drive is ChainDrive.STEADY else "root mean square of x of m0"
        caption += (
            f" Map: {what} over place and time in the last run; dots: impacts. Bottom: for each cell, its "
            "mean energy with standard error, and its number of impacts."
        )
    return style.DrawnFigure(
        name="chain",
        title=f"Chain: {found.request.title}",
        caption=f"{caption} {found.cost_sentence} {found.request.sentence}",
        figure=figure,
        tables=tuple(_numbers(found)),
    )


def _shade(axes: Axes, found: ChainAnswer) -> None:
    top_hz = float(found.linear_hz[-1])
    for gap in found.gaps:
        axes.axvspan(gap.lower_hz, min(gap.upper_hz, top_hz), color=style.COLLIDING)
    axes.set_xlim(0.0, top_hz)


def _waves(axes: Axes, found: ChainAnswer) -> None:
    _shade(axes, found)
    for band_hz in found.bands_hz.T:
        axes.plot(band_hz, found.wave_numbers / np.pi, color=style.LINEAR, label="phase")
    axes.set(ylabel="phase / π", ylim=(0.0, 1.0))
    decay = axes.twinx()
    decay.plot(found.linear_hz, found.attenuation_db, color=style.BOUNDS, linewidth=0.8)
    decay.set_ylabel("decay [dB per unit]", color=style.BOUNDS)
    decay.set_ylim(0.0, 1.1 * float(np.max(found.attenuation_db)))
    decay.grid(visible=False)
    axes.tick_params(labelbottom=False)


def _draw_cells(axes: Axes, found: ChainAnswer) -> None:
    _shade(axes, found)
    for number, (cells, place, name) in enumerate(found.shown_cells):
        colour = style.LEVELS[number % len(style.LEVELS)]
        linear = np.maximum(found.linear_transmission(cells)[:, place], _SMALLEST)
        axes.plot(found.linear_hz, linear, "--", color=colour, linewidth=0.8, label=name)
        over_hz, driven = found.driven_transmission(cells, place)
        marker = "o" if found.request.drive is ChainDrive.STEADY else ""
        axes.plot(over_hz, np.maximum(driven, _SMALLEST), color=colour, marker=marker)
    axes.plot([], "--", color=style.BOUNDS, linewidth=0.8, label="without contact")
    style.magnitude_axis(axes)
    axes.set(ylabel="|x / U|", xlabel="frequency [Hz]")


def _map(figure: Figure, axes: Axes, found: ChainAnswer, run: ChainRun) -> None:
    largest = float(np.nanmax(np.abs(run.motion_m), initial=0.0))
    factor, unit = style.with_prefix(largest, "m")
    edges = np.arange(run.cells + 1) + 0.5
    middle = run.time_s
    half = 0.5 * float(middle[1] - middle[0]) if middle.size > 1 else 0.5
    times = np.append(middle - half, middle[-1] + half)
    is_steady = found.request.drive is ChainDrive.STEADY
    top = max(factor * largest, _NOTHING)
    mesh = axes.pcolormesh(
        times,
        edges,
        factor * (run.motion_m if is_steady else np.maximum(np.abs(run.motion_m), _NOTHING)).T,
        cmap="RdBu_r" if is_steady else "viridis",
        norm=Normalize(-top, top) if is_steady else LogNorm(top * 10.0**-_DECADES, top),
        rasterized=True,
    )
    size = 2.0 if is_steady else 0.6
    axes.plot(run.impact_time_s, run.impact_cell + 1, ".", color=style.MEASURED, markersize=size)
    axes.set(xlim=(times[0], times[-1]), ylabel="cell", xlabel="time [s]")
    axes.yaxis.set_major_locator(MaxNLocator(integer=True))
    axes.grid(visible=False)
    what = "x" if is_steady else "rms of x"
    figure.colorbar(mesh, ax=axes, label=f"{what} of m0 [{unit}]", pad=0.01)


def _per_cell(energies: Axes, impacts: Axes, run: ChainRun) -> None:
    place = np.arange(1, run.cells + 1)
    factor, unit = style.with_prefix(float(np.nanmax(run.energy_j, initial=0.0)), "J")
    energy, error = factor * run.energy_j, factor * run.energy_error_j
    energies.errorbar(place, energy, error, fmt="o", color=style.SIMULATED)
    if float(np.nanmin(run.energy_j, initial=math.inf)) > 0.0:
        style.magnitude_axis(energies)
    energies.set_ylabel(f"mean energy [{unit}]")
    impacts.bar(place, run.impacts / run.observed_s, color=style.MEASURED, width=0.7)
    impacts.set_ylabel("impacts per second")
    for axes in (energies, impacts):
        axes.set_xlabel("cell, from the base")
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))


def _numbers(found: ChainAnswer) -> list[Table]:
    waves = table(
        "chain_waves",
        linear_hz=found.linear_hz,
        decay_db_per_unit=found.attenuation_db,
        wave_number_rad=found.wave_numbers,
        **{f"band_{k + 1}_hz": band for k, band in enumerate(found.bands_hz.T)},
    )
    if not found.runs:
        return [waves]
    places = [
        (run, line, cell)
        for run in found.runs
        for line in range(len(run.over_hz))
        for cell in range(run.cells)
    ]
    across = table(
        "chain_transmission",
        cells=[run.cells for run, _, _ in places],
        frequency_hz=[run.over_hz[line] for run, line, _ in places],
        cell=[cell + 1 for _, _, cell in places],
        transmission=[run.transmission[line, cell] for run, line, cell in places],
    )
    each = [run for run in found.runs for _ in range(run.cells)]
    cells = table(
        "chain_cells",
        **rows(each, "cells frequency_hz"),
        cell=np.concatenate([np.arange(run.cells) + 1 for run in found.runs]),
        **rows(found.runs, "energy_j energy_error_j impacts largest_p_m=largest_m"),
        **rows(each, "exponent_per_s exponent_error_per_s"),
    )
    return [waves, across, cells]
