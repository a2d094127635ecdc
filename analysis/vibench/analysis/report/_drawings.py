"""Figures, sentences, numbers and tables of a report for each kind of excitation."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Any, Generic, TypeVar

import numpy as np

from vibench.acquisition.instruments import PlugInKind
from vibench.acquisition.plan import EXCITATION_KINDS, Family, excitation_text, rows_by_kind
from vibench.sim import Specimen

from ..chaos.verdict import MotionKind
from ..frequency_response.modal_fit import Resonance
from ..kinds import AnyResult, DwellResult, NoiseResult, Result, SteppedSineResult, SweepResult
from ..overlay.draws import CLOCK_TOLERANCE
from ..overlay.overlay import (
    PAPER_RESONANCES_HZ,
    PAPER_TERMINAL_RESONANCES_HZ,
    PREDICTION_S,
    RESPONSE_I,
    RESPONSE_II,
    WINDOW_S,
    AbstractOverlay,
    DwellOverlay,
)
from ..recordings.checks import AbstractAnalysis
from ..recordings.facts import known_specimen, specimen_difference, specimen_of
from ..results.campaign_results import CampaignResults, budgets_of
from ..sine.stepped_response import feedback_sentences, tracked_resonances
from ..sine.sweep_analysis import Edge
from ..tables import plus_minus
from ..uncertainty.budget import COVERAGE, Budget, Cause
from ._style import DrawnFigure, agreement_text, bench_levels_figure, excitation_figure
from ._sweep import hysteresis_figure, regions_text, sweep_figure, sweep_orders_figure


@dataclass(frozen=True)
class ReportTable:
    """Table of texts with a note below it."""

    title: str
    headings: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    note: str = ""


def noise_findings(result: NoiseResult) -> Iterator[str]:
    """Yield sentences on the resonances and the simulated transmission."""
    response = result.analysis.response
    peaks = [f"{each.frequency_hz:.1f}" for each in response.resonances]
    where = f"resonance{'s' * (len(peaks) > 1)} at {', '.join(peaks)} Hz"
    if not peaks:
        apart_hz = np.median(np.diff(response.frequency_response.frequency_hz))
        where = f"no significant resonance; lines are {apart_hz:.2g} Hz apart, narrower modes may be missed"
    yield f"Noise at {result.analysis.excitation.amplitude_vpp:g} Vpp: {where}."
    yield from feedback_sentences(result.analysis.facts.feedback)
    if result.overlay is not None:
        yield (
            f"Simulated from the {result.overlay.run.driven.value}: median difference "
            f"{result.overlay.difference.median_abs_db:.2g} dB, "
            f"{result.overlay.run.impact_rate_hz:.0f} impacts per second{agreement_text(result.overlay)}."
        )
    remarks = [each.remark for each in result.analysis.response.resonances if each.remark]
    if remarks:
        yield f"Remarks: {'; '.join(remarks)}."


def sweep_findings(result: SweepResult) -> Iterator[str]:
    """Yield sentences on the frequencies at which the masses collide, measured and simulated."""
    plan = result.analysis.excitation
    yield (
        f"Sweep at {plan.amplitude_vpp:g} Vpp from {plan.start_hz:g} to {plan.stop_hz:g} Hz "
        f"{result.analysis.rate_text}: {regions_text(result.analysis.collisions)}."
    )
    if result.overlay is not None:
        yield f"Simulated: {regions_text(result.overlay.collisions)}{agreement_text(result.overlay)}."


def stepped_findings(result: SteppedSineResult) -> Iterator[str]:
    """Yield sentences on the largest Response II and on the results of feedback."""
    found, plan = result.analysis.response.response_ii, result.analysis.excitation
    yield (
        f"{EXCITATION_KINDS[plan.kind].title} at {plan.amplitude_vpp:g} Vpp: Response II "
        f"up to {found.max():.3g} in {found.size} steps."
    )
    yield from feedback_sentences(result.analysis.facts.feedback)


def dwell_findings(result: DwellResult) -> Iterator[str]:
    """Yield sentences on Responses I and II, measured and simulated, and on the kind of motion."""
    found, plan = result.analysis.response, result.analysis.excitation
    verdict = result.analysis.motion.verdict
    text = (
        f"Dwell at {plan.frequency_hz:g} Hz and {plan.amplitude_vpp:g} Vpp (A0 = "
        f"{1e6 * found.drive.amplitude_m:.3g} µm): Response I {found.response_i:.3g}, Response II "
        f"{found.response_ii:.3g}, {verdict.text}"
    )
    if verdict.kind is MotionKind.UNDECIDED:
        text += f" ({verdict.why})"
    yield f"{text}."
    if result.overlay is not None:
        simulated = result.overlay.response
        agreement = agreement_text(result.overlay).removeprefix("; ")
        yield f"Simulated: {agreement or f'{simulated.response_i:.3g} and {simulated.response_ii:.3g}'}."


def _specimen_differences(results: CampaignResults) -> Iterator[str]:
    """Yield a sentence for each overlaid specimen that is not the one described in its recordings."""
    names: dict[tuple[Specimen, Specimen | None], list[str]] = {}
    for each in results.results:
        if each.overlay is not None:
            facts = each.analysis.facts
            pair = each.overlay.run.specimen, known_specimen(facts.bench)
            names.setdefault(pair, []).append(facts.name)
    for pair, alike in names.items():
        if difference := specimen_difference(*pair, ", ".join(alike)):
            yield difference


def limits(results: CampaignResults) -> Iterator[str]:
    """Yield sentences on the limits of these results."""
    differences = tuple(_specimen_differences(results))
    if any(each.is_simulated for each in results.facts):
        yield (
            "The instruments were simulated: the samples result from a simulated generator, amplifier, "
            "shaker, specimen, vibrometer and converter."
        )
        if not differences:
            yield (
                "The overlaid simulation uses the same model: agreement shows that the processing from "
                "generator to figure is correct, but not that the model is correct."
            )
    yield from differences
    runs = [each.overlay.run for each in results.results if each.overlay is not None]
    if runs:
        for specimen in dict.fromkeys(each.specimen for each in runs):
            ratios = np.divide(specimen.dampings, specimen.stiffnesses)
            damping = f"c = {ratios[0]:.3g} s · k"
            if not np.allclose(ratios, ratios[0], rtol=1e-3, atol=0.0):
                damping = f"c0, c1, c2 = {', '.join(f'{each:.3g}' for each in specimen.dampings)} N s/m"
            gaps = " and ".join(f"{1e6 * each:.3g}" for each in dict.fromkeys(specimen.gaps_m))
            yield (
                f"The simulation assumes damping of {damping} and a gap of {gaps} µm. The paper does not "
                "state the damping; with other values, the collision regions would differ."
            )
        lows_hz = [each.base_band_hz[0] for each in runs if each.base_band_hz is not None]
        if lows_hz:
            yield (
                f"The recorded base acceleration was integrated above {min(lows_hz):.3g} Hz (a quarter of "
                "the lowest drive frequency). Simulations driven by this motion omit slower motion of the "
                "base, and their impacts do not move the base."
            )
        if any(each.driven.by_voltage for each in runs):
            yield (
                "The draws from the recorded voltage differ in initial state, noise of the channels, clock "
                f"of the converter ({1e6 * CLOCK_TOLERANCE:.0f} ppm) and the parameters of a fitted shaker, "
                "within their uncertainty. Calibrations and the parameters of the specimen are taken as "
                "exact. Of 100 agreeing quantities, one exceeds the limit of |z| by chance."
            )
        yield (
            f"Responses to sines are simulated from rest for {PREDICTION_S:g} s and evaluated over the last "
            f"{WINDOW_S:g} s. Where two motions are stable, a sweep or noise may show another motion."
        )
    if results.dwells or results.sweeps:
        yield (
            "In chaotic motion, two equal experiments differ: Response I scatters by about ten per cent or "
            "more, and only the statistics of time signals can be compared."
        )
    if results.noise:
        yield (
            "With collisions, the transmission from noise is the best linear approximation at that level, "
            "not a property of the specimen. Bounds include the scatter over realisations (95 % per line)."
        )


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
        result.analysis.motion.verdict.text,
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


A = TypeVar("A", bound=AbstractAnalysis[Any, Any])
L = TypeVar("L", bound=AbstractOverlay[Any])


@dataclass(frozen=True)
class Drawing(Generic[A, L]):
    """Presentation of results of one kind: a card for each result, and common figures of several results."""

    figures: Callable[[Result[A, L]], Iterator[DrawnFigure]]
    """Figures of a card; the first figure is visible, all other figures are folded."""
    findings: Callable[[Result[A, L]], Iterator[str]]
    """Sentences of a card: the main result first, then its statistics."""
    numbers: Callable[[Result[A, L]], Iterator[tuple[str, str]]]
    """Main numbers of a card with bounds, the most important first."""
    tables: tuple[Callable[[Sequence[Result[A, L]]], ReportTable], ...] = ()
    together: Callable[[Sequence[Result[A, L]]], Iterator[DrawnFigure]] = lambda _: iter(())


def _noise_figures(noise: NoiseResult) -> Iterator[DrawnFigure]:
    # Load only the figures that a report shows.
    from ._transmission import distortion_figure, transmission_figure  # noqa: PLC0415 - as above

    yield transmission_figure(noise.analysis, noise.overlay)
    if noise.analysis.response.periodic is not None:
        yield distortion_figure(noise.analysis, noise.analysis.response.periodic)


def _noise_levels(noise: Sequence[NoiseResult]) -> Iterator[DrawnFigure]:
    from ..results.spectral_functions import scans_of  # noqa: PLC0415 - as above
    from ._transmission import scan_figure, transmission_levels_figure  # noqa: PLC0415 - as above

    for scan in scans_of([each.analysis for each in noise]):
        yield scan_figure(scan)
    levels = [each.analysis for each in noise if each.analysis.facts.measurement.point is None]
    if len(levels) > 1:
        yield transmission_levels_figure(levels)


def _dwell_figures(dwells: Sequence[DwellResult]) -> Iterator[DrawnFigure]:
    from ._dwells import dwells_figure, portraits_figure  # noqa: PLC0415 - as above

    yield dwells_figure([(each.analysis, each.overlay) for each in dwells])
    yield portraits_figure([each.analysis for each in dwells])


def _dwell_levels(dwells: Sequence[DwellResult]) -> Iterator[DrawnFigure]:
    """Draw all dwells at one frequency in one figure."""
    for _, group in groupby(dwells, key=lambda each: each.analysis.excitation.frequency_hz):
        same = tuple(group)
        if len(same) > 1:
            yield from _dwell_figures(same)


def _stepped_figures(stepped: SteppedSineResult) -> Iterator[DrawnFigure]:
    from ._stepped_sine import STEPPED_FREQUENCIES, stepped_sine_figure  # noqa: PLC0415 - as above

    yield stepped_sine_figure(stepped.analysis, stepped.overlay, STEPPED_FREQUENCIES)


def _level_figures(level: SteppedSineResult) -> Iterator[DrawnFigure]:
    from ._stepped_sine import STEPPED_LEVELS, stepped_sine_figure  # noqa: PLC0415 - as above

    yield stepped_sine_figure(level.analysis, level.overlay, STEPPED_LEVELS)


def _level_findings(level: SteppedSineResult) -> Iterator[str]:
    from ._stepped_sine import stepped_level_caption  # noqa: PLC0415 - as above

    yield stepped_level_caption(level.analysis.response)


def _tracked_figures(tracked: SteppedSineResult) -> Iterator[DrawnFigure]:
    """Draw the tracked resonance over level if one was found, otherwise the stepped sine."""
    from . import _stepped_sine as stepped_sine  # noqa: PLC0415 - as above

    if tracked_resonances(tracked.analysis.facts.feedback):
        yield stepped_sine.backbone_figure(tracked.analysis, tracked.overlay)
    else:
        look = stepped_sine.TRACKED_RESONANCE
        yield stepped_sine.stepped_sine_figure(tracked.analysis, tracked.overlay, look)


def _hysteresis_figures(sweeps: Sequence[SweepResult]) -> Iterator[DrawnFigure]:
    """Draw each upward sweep with the first downward sweep of the same level and an overlapping band."""
    for up in sweeps:
        plan = up.analysis.excitation
        for down in sweeps:
            other = down.analysis.excitation
            is_back = plan.start_hz < plan.stop_hz and other.start_hz > other.stop_hz
            overlaps = other.stop_hz < plan.stop_hz and other.start_hz > plan.start_hz
            if is_back and overlaps and plan.amplitude_vpp == other.amplitude_vpp:
                yield hysteresis_figure(up.analysis, down.analysis)
                break


def _budget_numbers(result: AnyResult) -> Iterator[tuple[str, str]]:
    return ((each.quantity, each.text) for each in budgets_of(result))


def _noise_numbers(noise: NoiseResult) -> Iterator[tuple[str, str]]:
    """Yield the main numbers of noise: resonances, base level, and other uncertainty budgets."""
    budgets = budgets_of(noise)
    yield from ((each.quantity, each.text) for each in budgets if each.unit == "Hz")
    level = noise.analysis.response.base_level
    bounds = plus_minus(level.rms_acceleration, 2 * level.relative_sd * level.rms_acceleration)
    yield "base acceleration, rms", f"{bounds} m/s²"
    yield from ((each.quantity, each.text) for each in budgets if each.unit != "Hz")


def _sweep_numbers(sweep: SweepResult) -> Iterator[tuple[str, str]]:
    """Yield the main numbers of a sweep: onset of collisions, and uncertainty budgets."""
    for region in sweep.analysis.collisions.regions[:1]:
        yield "collisions begin at", edge_text(region.start, "start of sweep" if region.reaches_start else "")
    amplitude, *largest = _budget_numbers(sweep)
    yield from (*largest, amplitude)


def _stepped_numbers(stepped: SteppedSineResult) -> Iterator[tuple[str, str]]:
    """Yield the main numbers of stepped sines: tracked resonance if any, budgets, and base amplitude."""
    for each in tracked_resonances(stepped.analysis.facts.feedback)[:1]:
        yield "phase resonance", f"{plus_minus(each.frequency_hz, 2 * each.u_frequency_hz)} Hz"
    yield from _budget_numbers(stepped)
    found = stepped.analysis.response
    if found.response_ii.size:
        top = int(np.argmax(found.response_ii))
        amplitude = plus_minus(1e6 * found.drive_amplitude_m[top], 2e6 * found.sd_drive_amplitude_m[top])
        yield f"base amplitude A0, at {found.frequency_hz[top]:.4g} Hz", f"{amplitude} µm"


STEPPED: Drawing[Any, Any] = Drawing(_stepped_figures, stepped_findings, _stepped_numbers)
"""Presentation of stepped recordings; other packages may replace parts of it for their kind of excitation."""
DRAWINGS: Mapping[str, Drawing[Any, Any]] = rows_by_kind(
    {
        Family.NOISE: Drawing(
            _noise_figures, noise_findings, _noise_numbers, (resonance_table,), _noise_levels
        ),
        Family.SWEEP: Drawing(
            lambda sweep: iter(
                (sweep_figure(sweep.analysis, sweep.overlay), sweep_orders_figure(sweep.analysis))
            ),
            sweep_findings,
            _sweep_numbers,
            (collision_table,),
            _hysteresis_figures,
        ),
        Family.DWELL: Drawing(
            lambda dwell: _dwell_figures((dwell,)),
            dwell_findings,
            _budget_numbers,
            (dwell_table, line_table),
            _dwell_levels,
        ),
        Family.STEPPED: STEPPED,
    },
    {
        "stepped_level": Drawing(_level_figures, _level_findings, _stepped_numbers),
        "resonance_tracking": Drawing(
            _tracked_figures,
            lambda tracked: feedback_sentences(tracked.analysis.facts.feedback),
            _stepped_numbers,
        ),
    },
    PlugInKind.DRAWING,
)
"""Presentation of results, keyed by the kind of excitation."""


def figures_together(results: CampaignResults) -> Iterator[DrawnFigure]:
    """Draw several recordings of one kind in common figures."""
    for drawing, group in groupby(results.in_order, key=lambda each: DRAWINGS[each.kind]):
        yield from drawing.together(tuple(group))


def result_figures(results: CampaignResults) -> Iterator[DrawnFigure]:
    """Draw the common figures, then the figures of each result: noise, sweeps, dwells, stepped sines."""
    yield from figures_together(results)
    for each in results.in_order:
        yield from DRAWINGS[each.kind].figures(each)


def findings(results: CampaignResults) -> Iterator[str]:
    """Yield sentences on each measurement and its simulation, in the order of the report.

    Parameters
    ----------
    results
        Results of `vibench.analysis.analyse_files`.

    Returns
    -------
    Sentences on the fit to all recordings, then on each recording, starting with its name.
    """
    yield from results.model_sentences
    for each in results.in_order:
        yield from (f"{each.analysis.facts.name}: {text}" for text in DRAWINGS[each.kind].findings(each))


def result_sentence(result: AnyResult) -> str:
    """Return the first finding; without findings, a description of the plan."""
    sentence = next(DRAWINGS[result.kind].findings(result), "")
    return sentence or f"{excitation_text(result.analysis.excitation)}: no result."


def recording_figures(result: AnyResult) -> tuple[DrawnFigure, ...]:
    """Draw the plan, and the smallest and largest values of every channel."""
    facts = result.analysis.facts
    return excitation_figure(facts.measurement), bench_levels_figure(facts)
