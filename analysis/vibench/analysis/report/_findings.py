"""What was found in each recording, the result first and then its statistics, and the limits of a report."""

from collections.abc import Iterator

from vibench.acquisition.plan import EXCITATION_KINDS

from ..chaos.verdict import MotionKind
from ..figures.ensemble_band import agreement_text
from ..figures.portraits import verdict_text
from ..figures.stepped_sine import stepped_level_caption
from ..figures.sweep import regions_text
from ..kinds.analysis_kind import DwellResult, NoiseResult, SteppedSineResult, SweepResult
from ..model.draws import CLOCK_TOLERANCE
from ..model.prediction import PREDICTION_S, WINDOW_S
from ..results.campaign_results import CampaignResults
from ..sine.tracked_resonance import feedback_sentences


def noise_findings(result: NoiseResult) -> Iterator[str]:
    """Say where the resonances are, and how far the simulation lies from the transmission."""
    peaks = ", ".join(f"{each.frequency_hz:.1f}" for each in result.analysis.response.resonances)
    where = f"resonances at {peaks} Hz" if peaks else "no resonance above its uncertainty"
    yield f"Noise at {result.analysis.excitation.amplitude_vpp:g} Vpp: {where}."
    yield from feedback_sentences(result.analysis.facts.feedback)
    if result.laid is not None:
        yield (
            f"The simulation under the {result.laid.run.driven.value} lies "
            f"{result.laid.difference.median_abs_db:.2g} dB away (median) and strikes "
            f"{result.laid.run.impact_rate_hz:.0f} times per second{agreement_text(result.laid)}."
        )
    remarks = [each.remark for each in result.analysis.response.resonances if each.remark]
    if remarks:
        yield f"Remarks: {'; '.join(remarks)}."


def sweep_findings(result: SweepResult) -> Iterator[str]:
    """Say where the masses collide, measured and simulated."""
    plan = result.analysis.excitation
    yield (
        f"Sweep at {plan.amplitude_vpp:g} Vpp from {plan.start_hz:g} to {plan.stop_hz:g} Hz, "
        f"{result.analysis.rate_text}: {regions_text(result.analysis.collisions)}."
    )
    if result.laid is not None:
        yield f"Simulated: {regions_text(result.laid.collisions)}{agreement_text(result.laid)}."


def stepped_findings(result: SteppedSineResult) -> Iterator[str]:
    """Say how far Response II went in steps of frequency, and what feedback found."""
    found, plan = result.analysis.response.response_ii, result.analysis.excitation
    yield (
        f"{EXCITATION_KINDS[plan.kind].title} at {plan.amplitude_vpp:g} Vpp: Response II "
        f"up to {found.max():.3g} in {found.size} steps."
    )
    yield from feedback_sentences(result.analysis.facts.feedback)


def level_findings(result: SteppedSineResult) -> Iterator[str]:
    """Say between which levels the motion jumps."""
    yield stepped_level_caption(result.analysis.response)


def tracked_findings(result: SteppedSineResult) -> Iterator[str]:
    """Say where the resonance was at each level."""
    yield from feedback_sentences(result.analysis.facts.feedback)


def dwell_findings(result: DwellResult) -> Iterator[str]:
    """Say both responses, measured and simulated, and how the motion repeats."""
    found, plan = result.analysis.response, result.analysis.excitation
    verdict = result.analysis.motion.verdict
    text = (
        f"Dwell at {plan.frequency_hz:g} Hz and {plan.amplitude_vpp:g} Vpp (A0 = "
        f"{1e6 * found.drive.amplitude_m:.3g} µm): Response I {found.response_i:.3g}, Response II "
        f"{found.response_ii:.3g}, {verdict_text(verdict)}"
    )
    if verdict.kind is MotionKind.UNDECIDED:
        text += f" ({verdict.why})"
    yield f"{text}."
    if result.laid is not None:
        simulated = result.laid.response
        told = agreement_text(result.laid).removeprefix("; ")
        yield f"Simulated: {told or f'{simulated.response_i:.3g} and {simulated.response_ii:.3g}'}."


def limits(results: CampaignResults) -> Iterator[str]:
    """Give the sentences that apply to these results."""
    if any(each.is_simulated for each in results.facts):
        yield (
            "The instruments were simulated: the samples are what the simulated generator's output does to "
            "the simulated amplifier, shaker, specimen, vibrometer and converter. The same model is laid "
            "over the measurement: agreement shows that the whole chain from generator to figure is right, "
            "not that the model is."
        )
    laid = [each.laid.run for each in results.results if each.laid is not None]
    if laid:
        specimen = laid[0].specimen
        damping = specimen.dampings[0] / specimen.stiffnesses[0]
        gaps = " and ".join(f"{1e6 * each:.3g}" for each in dict.fromkeys(specimen.gaps_m))
        lows_hz = [each.base_band_hz[0] for each in laid if each.base_band_hz is not None]
        yield (
            f"The simulation takes the damping as c = {damping:.3g} s · k and a gap of "
            f"{gaps} µm. The paper leaves the damping open; other readings of it give "
            "other collision regions."
        )
        if lows_hz:
            yield (
                f"The recorded base acceleration was integrated above {min(lows_hz):.3g} Hz (a quarter of "
                "the lowest frequency played); slower motion of the base is in no curve simulated "
                "under it, and the recorded base does not yield to the blows of a specimen that moves "
                "otherwise."
            )
        if any(each.driven.by_voltage for each in laid):
            yield (
                "Draws under the recorded voltage differ by their starts, the channels' noise and the "
                f"tolerance of the converter's clock ({1e6 * CLOCK_TOLERANCE:.0f} ppm), and by the "
                "uncertainty of a shaker that was fitted; calibrations and the specimen's numbers are "
                "taken as exact. A limit on |z| is exceeded by chance in one of a hundred agreeing "
                "quantities."
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
