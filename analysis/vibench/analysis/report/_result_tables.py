"""Tables of a report: resonances, collisions, dwells and the spectral lines of dwells."""

from collections.abc import Iterator, Sequence

import numpy as np

from ..figures.dwells import verdict_text
from ..frequency_response.modal_fit import Resonance
from ..kinds import AnyResult, DwellResult, NoiseResult, SweepResult
from ..overlay.overlay import (
    PAPER_RESONANCES_HZ,
    PAPER_TERMINAL_RESONANCES_HZ,
    RESPONSE_I,
    RESPONSE_II,
    DwellOverlay,
)
from ..recordings.facts import specimen_of
from ..results.campaign_results import budgets_of
from ..sine.sweep_analysis import Edge
from ..tables import plus_minus
from ..uncertainty.budget import COVERAGE, Budget, Cause
from ._page import ReportTable

_NEAR = 0.08
"""Largest relative distance between resonances in one table row; modes are at least 9 % apart."""
ABSENT = "–"
_SMALLEST_BIAS = 1e-3
"""Smallest noise bias that is printed; a smaller bias does not matter."""
_PAPER_COLLISION = "about 240 to 290 Hz"
"""Collision region in Gong et al. 2025, section 5: the grey area of the sweep."""


def resonance_table(noise: Sequence[NoiseResult]) -> ReportTable:
    """Return a table of measured, simulated, modelled and published resonances."""
    return ReportTable(
        "Resonances of the transmission",
        (
            "noise",
            "measured [Hz]",
            "damping ratio [%]",
            "peak |F/U''| [kg]" if noise and noise[0].analysis.view.is_force else "peak |x/U|",
            "simulated [Hz]",
            "model [Hz]",
            "paper [Hz]",
        ),
        tuple(row for each in noise for row in _resonance_rows(each)),
        "± is two standard deviations, from the scatter of lines only. Simulated: one draw from the recorded "
        "voltage or base motion, with the same estimator. Model: undamped natural frequency, without "
        "contact or (terminal) with m1 stuck to m2. Paper: Gong et al. 2025, section 5.",
    )


def uncertainty_table(results: Sequence[AnyResult]) -> ReportTable:
    """Return a table of each quantity's uncertainty, with the contribution of each cause."""
    return ReportTable(
        "Contributions to the uncertainty",
        ("recording", "quantity", "value", *(each.value for each in Cause)),
        tuple(
            (each.analysis.facts.name, budget.quantity, budget.text, *(_share(budget, c) for c in Cause))
            for each in results
            for budget in budgets_of(each)
        ),
        f"± is the expanded uncertainty, k = {COVERAGE:g}, of all stated contributions, as in JCGM "
        "100:2008; each column is a relative standard uncertainty. Contributions that the hardware "
        "configuration does not state are not included. Chance: difference between repeated runs.",
    )


def _share(budget: Budget, cause: Cause) -> str:
    share = budget.share(cause)
    if share is None:
        return "not stated"
    return f"{100 * share:.2g} %" if share else ABSENT


def _resonance_rows(result: NoiseResult) -> Iterator[tuple[str, ...]]:
    level = f"{result.analysis.excitation.amplitude_vpp:g} Vpp"
    specimen = specimen_of(result.analysis.facts.bench)
    free = [(float(each), "") for each in specimen.natural_frequencies_hz]
    bound = [(float(each), " (terminal)") for each in specimen.bound_frequencies_hz]
    paper = [(each, "") for each in PAPER_RESONANCES_HZ] + [
        (each, " (terminal)") for each in PAPER_TERMINAL_RESONANCES_HZ
    ]
    simulated = () if result.overlay is None else result.overlay.response.resonances
    found = result.analysis.response.resonances
    if not found:
        yield level, "none above its uncertainty", *([ABSENT] * 5)
    for each in found:
        beside = nearest_resonance(each.frequency_hz, simulated)
        yield (
            level,
            plus_minus(each.frequency_hz, 2 * each.sd_frequency_hz),
            plus_minus(100 * each.damping_ratio, 200 * each.sd_damping_ratio),
            plus_minus(each.peak_magnitude, 2 * each.sd_peak_magnitude),
            ABSENT if beside is None else plus_minus(beside.frequency_hz, 2 * beside.sd_frequency_hz),
            _nearest(each.frequency_hz, [*free, *bound], ".1f"),
            _nearest(each.frequency_hz, paper, ".0f"),
        )


def nearest_resonance(frequency_hz: float, among: Sequence[Resonance]) -> Resonance | None:
    """Return the nearest resonance if it is close enough to be the same mode, else None."""
    near = [each for each in among if abs(each.frequency_hz - frequency_hz) < _NEAR * frequency_hz]
    return min(near, key=lambda each: abs(each.frequency_hz - frequency_hz), default=None)


def _nearest(frequency_hz: float, among: Sequence[tuple[float, str]], form: str) -> str:
    value, note = min(among, key=lambda each: abs(each[0] - frequency_hz))
    if abs(value - frequency_hz) > _NEAR * frequency_hz:
        return ABSENT
    return f"{value:{form}}{note}"


def collision_table(sweeps: Sequence[SweepResult]) -> ReportTable:
    """Return a table of the collision regions in each sweep: measured, simulated and published."""
    return ReportTable(
        "Frequencies with collisions in a sweep",
        ("sweep", "measured from", "measured to", "simulated from", "simulated to", "paper"),
        tuple(row for each in sweeps for row in _collision_rows(each)),
        "Bounds are the nearest interval clearly without collisions and the first or last interval clearly "
        "with collisions. The end of the collisions is random, and differs between runs. "
        "The motion that a sweep follows depends on its direction and on its first frequency.",
    )


def _collision_rows(result: SweepResult) -> Iterator[tuple[str, ...]]:
    plan = result.analysis.excitation
    name = f"{plan.amplitude_vpp:g} Vpp, {plan.start_hz:g} to {plan.stop_hz:g} Hz"
    measured = result.analysis.collisions.regions
    simulated = () if result.overlay is None else result.overlay.collisions.regions
    if not measured and not simulated:
        found = "not determined" if result.analysis.collisions.too_fast_hz else "no collision"
        yield name, found, ABSENT, ABSENT, ABSENT, _PAPER_COLLISION
    for number in range(max(len(measured), len(simulated))):
        cells = [name]
        for regions in (measured, simulated):
            if number < len(regions):
                region = regions[number]
                cells.append(edge_text(region.start, "start of sweep" if region.reaches_start else ""))
                cells.append(edge_text(region.stop, "end of sweep" if region.reaches_stop else ""))
            else:
                cells += [ABSENT, ABSENT]
        yield (*cells, _PAPER_COLLISION)


def edge_text(edge: Edge, instead: str) -> str:
    """Return the text ``instead`` unless it is empty; otherwise return an edge with its bounds as text."""
    return instead or f"{edge.frequency_hz:.1f} ({edge.lower_hz:.1f} to {edge.upper_hz:.1f}) Hz"


def dwell_table(dwells: Sequence[DwellResult]) -> ReportTable:
    """Return a table of Responses I and II of every dwell, measured and simulated."""
    return ReportTable(
        "Dwells: responses over the last seconds",
        (
            "dwell",
            "A0 [µm]",
            "Response I",
            "noise bias of I",
            "Response II",
            "motion",
            "simulated I",
            "z of I",
            "simulated II",
            "z of II",
            "impacts per s (sim.)",
        ),
        tuple(_dwell_row(each) for each in dwells),
        "Response I: largest |x| in the window, over A0; in chaos, a random value. Response II:"
        " component at the drive frequency, over A0. ± is the expanded uncertainty (k = 2); the table of"
        " uncertainty shows its parts. Simulated: median and 95 % band of the draws from the recorded "
        "voltage, or one run from the recorded base motion; z: standardised difference from the draws; "
        "|z| exceeds 2.6 in one of 100 agreeing cases.",
    )


def _dwell_row(result: DwellResult) -> tuple[str, ...]:
    found, overlay = result.analysis.response, result.overlay
    plan = result.analysis.excitation
    amplitude, first, second = budgets_of(result)
    if np.isnan(found.noise_bias_i):
        bias = "not determined"
    else:
        is_small = found.noise_bias_i < _SMALLEST_BIAS
        bias = f"below {_SMALLEST_BIAS:g}" if is_small else f"{found.noise_bias_i:.1g}"
    return (
        f"{plan.amplitude_vpp:g} Vpp, {plan.frequency_hz:g} Hz",
        amplitude.text.removesuffix(f" {amplitude.unit}").strip("()"),
        first.text,
        bias,
        second.text,
        verdict_text(result.analysis.motion.verdict),
        *_simulated_response(overlay, RESPONSE_I),
        *_simulated_response(overlay, RESPONSE_II),
        ABSENT if overlay is None else f"{overlay.run.impact_rate_hz:.0f}",
    )


def _simulated_response(overlay: DwellOverlay | None, name: str) -> tuple[str, str]:
    """Return the simulated response with its 95 % band, and the z of the measured response."""
    found = None if overlay is None else overlay.quantity(name)
    if overlay is None or found is None:
        return ABSENT, ABSENT
    if overlay.run.draws == 1:
        return f"{found.draws[0, 0]:.4g}", ABSENT
    if not found.compared:
        return "no draw has this motion", ABSENT
    return f"{found.median[0]:.4g} ({found.lower[0]:.4g} to {found.upper[0]:.4g})", f"{found.z[0]:+.2f}"


def _simulated_band(overlay: DwellOverlay, towards_hz: float) -> str:
    """Return a band's median level over all draws [dB]; for one run or a low level, use the first draw."""
    found = next((each for each in overlay.ensemble if each.frequency_hz[0] == towards_hz), None)
    if found is None or not found.compared:
        levels = [each.decibel for each in overlay.terminal if each.towards_hz == towards_hz]
        return f"{levels[0]:.1f}" if levels else ABSENT
    low, middle, high = (
        f"{20 * np.log10(each[0]):.1f}" if each[0] > 0.0 else "nothing"
        for each in (found.lower, found.median, found.upper)
    )
    return f"{middle} ({low} to {high}), z = {found.z[0]:+.1f}"


def line_table(dwells: Sequence[DwellResult]) -> ReportTable:
    """Return a table of each dwell's motion at multiples of the drive frequency and in the terminal bands."""
    rows = []
    for each in dwells:
        plan = each.analysis.excitation
        name = f"{plan.amplitude_vpp:g} Vpp, {plan.frequency_hz:g} Hz"
        for line in each.analysis.response.lines:
            if line.amplitude_m > 2 * line.sd_amplitude_m:
                size = plus_minus(1e6 * line.amplitude_m, 2e6 * line.sd_amplitude_m)
                place = f"{line.frequency_hz:.2f}"
                rows.append((name, line.label, place, size, f"{line.decibel:.1f}", ABSENT))
        for band in each.analysis.terminal:
            what = f"band around {band.towards_hz:.0f} Hz"
            place = f"{band.low_hz:.0f} to {band.high_hz:.0f}"
            size = f"{plus_minus(1e6 * band.rms_m, 2e6 * band.rms_m * band.relative_sd)} rms"
            simulated = ABSENT if each.overlay is None else _simulated_band(each.overlay, band.towards_hz)
            rows.append((name, what, place, size, f"{band.decibel:.1f}", simulated))
    return ReportTable(
        "Dwells: spectral lines of the displacement, and bands at the terminal resonances",
        ("dwell", "what", "frequency [Hz]", "displacement [µm]", "re drive line [dB]", "simulated [dB]"),
        tuple(rows),
        "Lines below two standard deviations are left out. Chaos fills bands, not lines: the level of a band "
        "is its rms over the rms of the line at the drive frequency.",
    )
