"""The report in short: one sentence for each thing that was found, with its numbers."""

from collections.abc import Iterator

from vibench.acquisition.plan import ResonanceTracking, SteppedLevel

from ..figures import regions_text, stepped_level_caption, verdict_text
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
