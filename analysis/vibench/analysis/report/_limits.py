"""What a report cannot say: stated in it, so that nobody reads more out of it than is there."""

from collections.abc import Iterator

from ..model import PREDICTION_S, WINDOW_S
from ..results import CampaignResults


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
