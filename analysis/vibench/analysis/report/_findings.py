"""The report in short: one sentence for each thing that was found, with its numbers.

What a report cannot say: stated in it, so that nobody reads more out of it than is there.
"""

from collections.abc import Iterator

from vibench.acquisition.plan import ResonanceTracking, SteppedLevel

from ..figures import regions_text, stepped_level_caption, verdict_text
from ..model import PREDICTION_S, WINDOW_S
from ..results import CampaignResults, DwellResult, NoiseResult, SweepResult
from ..sine import SteppedSineAnalysis, feedback_sentences


def findings(results: CampaignResults) -> Iterator[str]:
    """Say what each measurement found, weak to strong, and how far the simulation lies from it."""
    yield from results.model_said
    for noise in results.noise:
        yield _noise(noise)
    for sweep in results.sweeps:
        yield _sweep(sweep)
    for dwell in results.dwells:
        yield _dwell(dwell)
    for stepped in results.stepped:
        yield from _stepped(stepped.analysis)


def _noise(result: NoiseResult) -> str:
    peaks = ", ".join(f"{each.frequency_hz:.1f}" for each in result.analysis.response.resonances)
    where = f"resonances at {peaks} Hz" if peaks else "no resonance above its uncertainty"
    text = f"Noise at {result.analysis.excitation.amplitude_vpp:g} Vpp: {where}"
    if result.laid is None:
        return f"{text}."
    return (
        f"{text}; the simulation under the same base motion lies "
        f"{result.laid.difference.median_abs_db:.2g} dB away (median) and strikes "
        f"{result.laid.run.impact_rate_hz:.0f} times per second."
    )


def _sweep(result: SweepResult) -> str:
    plan = result.analysis.excitation
    text = (
        f"Sweep at {plan.amplitude_vpp:g} Vpp from {plan.start_hz:g} to {plan.stop_hz:g} Hz: "
        f"{regions_text(result.analysis.collisions)}"
    )
    return (
        f"{text}." if result.laid is None else f"{text}; simulated: {regions_text(result.laid.collisions)}."
    )


def _stepped(analysis: SteppedSineAnalysis) -> Iterator[str]:
    heard = tuple(feedback_sentences(analysis.facts.feedback))
    match analysis.excitation:
        case SteppedLevel():
            yield stepped_level_caption(analysis)
        case ResonanceTracking():
            yield from heard
        case plan:
            found = analysis.response.response_ii
            text = (
                f"Stepped sine at {plan.amplitude_vpp:g} Vpp: Response II up to {found.max():.3g} in "
                f"{found.size} steps."
            )
            yield " ".join([text, *heard])


def _dwell(result: DwellResult) -> str:
    found, plan = result.analysis.response, result.analysis.excitation
    text = (
        f"Dwell at {plan.frequency_hz:g} Hz and {plan.amplitude_vpp:g} Vpp (A0 = "
        f"{1e6 * found.drive.amplitude_m:.3g} µm): Response I {found.response_i:.3g}, Response II "
        f"{found.response_ii:.3g}, {verdict_text(result.analysis.motion.verdict)}"
    )
    if result.laid is None:
        return f"{text}."
    return (
        f"{text}; simulated {result.laid.response.response_i:.3g} and {result.laid.response.response_ii:.3g}."
    )


def limits(results: CampaignResults) -> Iterator[str]:
    """Give the sentences that apply to these results."""
    if any(each.is_simulated for each in results.facts):
        yield (
            "The instruments were simulated, with the same model that is laid over the measurement: "
            "agreement shows that the whole chain from generator to figure is right, not that the model is."
        )
    laid = [each.laid.run for each in results.results if each.laid is not None]
    if laid:
        specimen = laid[0].specimen
        damping = specimen.dampings[0] / specimen.stiffnesses[0]
        lowest_hz = min(each.base_low_hz for each in laid)
        yield (
            f"The simulation takes the damping as c = {damping:.3g} s · k and a gap of "
            f"{1e6 * specimen.gap_m:.3g} µm. The paper leaves the damping open; other readings of it give "
            "other collision regions."
        )
        yield (
            f"The recorded base acceleration was integrated above {lowest_hz:.3g} Hz (a quarter of the "
            "lowest frequency played); slower motion of the base is in no simulated curve."
        )
        yield (
            f"Curves under sines start from rest and run for {PREDICTION_S:g} s, the last {WINDOW_S:g} s "
            "observed. Where two states are stable, a sweep or noise may be in the other one."
        )
    if results.dwells or results.sweeps:
        yield (
            "In chaotic motion two equal experiments differ: Response I is one draw from a scatter of some "
            "ten per cent or more, and time signals are comparable in their statistics only."
        )
    if results.noise:
        yield (
            "With collisions the transmission under noise is the best linear approximation at that level, "
            "not a property of the specimen; bounds hold its scatter over realisations, 95 % line by line."
        )
