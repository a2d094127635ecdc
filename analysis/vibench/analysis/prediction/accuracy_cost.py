"""Computing time and error of each accuracy level, as measured in docs/accuracy.md."""

from dataclasses import dataclass

from vibench.sim import Accuracy, PowerLaw

from .progress import Exponent, SimulationRequest

MACHINE = "one core of a 2-core AMD EPYC"
"""Machine on which speeds and errors were measured; `vibench tradeoff` measures them on your machine."""


@dataclass(frozen=True)
class MeasuredLevel:
    """Speed (simulated seconds per core second) and error of one accuracy level, for the paper's specimen."""

    free: float
    """Speed without impacts: Hertz's contact, 260 Hz and 1 um."""
    periodic: float
    """Speed with periodic impacts: 130 Hz and 20 um."""
    chaos: float
    """Speed in chaos: 260 Hz and 5 um."""
    power: float
    """Speed with the contact law power:3, whose force acts at every p: 150 Hz and 10 um."""
    state_error: float
    """Error of the state of a periodic motion after 2 s, in units of 100 um and 0.1 m/s."""
    response_i_error: float
    """Relative error of Response I of a periodic motion, compared with the level `reference`."""


MEASURED = {
    Accuracy.QUICK: MeasuredLevel(21015.0, 3603.0, 3084.0, 3368.0, 4.9e-10, 2.9e-10),
    Accuracy.STANDARD: MeasuredLevel(21501.0, 4182.0, 3077.0, 2902.0, 4.9e-10, 2.9e-10),
    Accuracy.REFERENCE: MeasuredLevel(22280.0, 675.0, 542.0, 1650.0, 6.3e-12, 0.0),
}
CHAOS_SCATTER = 0.03
"""Relative scatter of Response I in chaos between different initial states, equal for all levels."""


def cost_sentences(request: SimulationRequest, cores: int) -> tuple[str, ...]:
    """Return sentences on error and computing time of a request on ``cores`` idle cores."""
    if request.has_target:
        wish = "" if request.error is None else f" to an error of {100.0 * request.error:g} %"
        limit = "a minute" if request.time_s is None else f"{request.time_s:g} s"
        return (f"{request.points} points, each{wish} within {limit}, on {cores} idle cores.",)
    level = MEASURED[request.accuracy]
    each_s = request.simulated_s / len(request.models)
    laws = [request.specimen_under(model).contact for model in request.models]
    powers = [isinstance(law, PowerLaw) for law in laws]
    shortest_s = sum(each_s / (level.power if is_power else level.free) for is_power in powers)
    longest_s = sum(each_s / (level.power if is_power else level.chaos) for is_power in powers)
    on_top = "; about twice as long with the exponent" if request.exponent is Exponent.COMPUTED else ""
    if request.budget_s > 0.0:
        on_top += f"; up to {request.budget_s:g} core seconds more if a motion depends on its initial state"
    error = f"{level.response_i_error:.0e}" if level.response_i_error else "none"
    shortest, longest = _time(shortest_s / cores), _time(longest_s / cores)
    return (
        (
            f"{request.points} points of {request.duration_s:g} s on {cores} idle cores: "
            f"{shortest} without impacts to {longest} in chaos{on_top}."
        ),
        (
            f"One core second simulates {level.free:.0f} s without impacts, {level.periodic:.0f} s of "
            f"periodic impacts, {level.chaos:.0f} s of chaos, {level.power:.0f} s of a power law."
        ),
        (
            f"Error of a periodic state: {level.state_error:.0e}; of Response I, relative to reference: "
            f"{error}. In chaos, Response I scatters by {CHAOS_SCATTER:.0%} at every accuracy."
        ),
        f"Measured on {MACHINE}.",
    )


def _time(seconds: float) -> str:
    minute = 60.0
    return f"{seconds:.2g} s" if seconds < minute else f"{seconds / minute:.2g} min"
