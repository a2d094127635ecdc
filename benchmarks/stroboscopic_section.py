"""States of a motion once per drive period, by the public `integrate`. SI units."""

from numpy.typing import ArrayLike

from vibench.sim import Accuracy, Harmonic, Specimen, integrate
from vibench.sim.engine.run import Outcome
from vibench.sim.specimen.specimen import Floats


def stroboscopic_section(
    specimen: Specimen,
    drive: Harmonic,
    periods: int,
    accuracy: Accuracy = Accuracy.STANDARD,
    initial_state: ArrayLike | None = None,
) -> Floats:
    """Integrate from time zero and return the state after every drive period, shape (periods, 6).

    Raises ValueError when ``periods`` is below 1, or the run did not reach its end.
    """
    if periods < 1:
        msg = f"A section of {periods} periods is not allowed: ask for 1 or more."
        raise ValueError(msg)
    run = integrate(
        specimen,
        drive,
        periods / drive.frequency_hz,
        accuracy,
        initial_state,
        sample_rate_hz=drive.frequency_hz,
    )
    if run.outcome is not Outcome.REACHED_END:
        msg = f"The motion at {drive.frequency_hz} Hz and {drive.amplitude_m} m was lost: {run.outcome.text}."
        raise ValueError(msg)
    return run.states[1 : periods + 1]
