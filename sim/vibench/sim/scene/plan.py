"""Plan of a scene before it is solved: method with reasons, and cost. SI units."""

import math
from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from ..specimen.contact_laws import NoContact, PowerLaw
from ..specimen.drive import Harmonic
from ..specimen.modes import harmonic_motion, modal_form
from ..specimen.specimen import Complex, Floats, Specimen, X, Y, Z
from .followed_run import CONTACTS, FLIGHT, whole_periods
from .prediction import Method
from .repetition import MOST_STATES
from .scene import CLEAR, FEWEST, MOST, AutomaticDuration, FixedDuration, Observable, Scene

if TYPE_CHECKING:
    from .cost import ExpectedTime

# Without contact a displacement is Re(S exp(i omega t)) + Re sum m_j exp(l_j t) with Re l_j <= 0. The
# magnitude is at most abs(S) + sum abs(m_j). If this bound for p is below the gap, no stop is touched.


@dataclass(frozen=True, eq=False)
class LinearMotion:
    """Linear motion without contact from time zero: steady part and transient."""

    drive: Harmonic
    rates: Complex
    """Eigenvalues of the modes [1/s], shape (n,)."""
    modes: Complex
    """Contribution of each mode to x, y, z, vx, vy, vz at time zero, shape (n, 6)."""
    steady: Complex
    """Phasors of the steady part for exp(i (omega t + phase)), shape (6,)."""

    @property
    def steady_p(self) -> complex:
        """Phasor of the steady p = y - z [m]."""
        return complex(self.steady[Y] - self.steady[Z])

    @property
    def steady_x(self) -> complex:
        """Phasor of the steady displacement x of m0 [m]."""
        return complex(self.steady[X])

    @property
    def largest_p_m(self) -> float:
        """Upper bound on abs(p) without contact, at all times [m]."""
        return abs(self.steady_p) + float(np.abs(self.modes[:, Y] - self.modes[:, Z]).sum())

    @property
    def slowest_rate(self) -> float:
        """Largest real part of the eigenvalues [1/s], zero or negative; decay rate of the transient."""
        return float(self.rates.real.max())

    def state(self, time_s: float) -> Floats:
        """Return x, y, z, vx, vy, vz at a time [s], shape (6,) [m, m/s]."""
        # Subtract whole cycles exactly: at late times, a rounding error would shift the phase.
        part = float(Fraction(time_s) * Fraction(self.drive.frequency_hz) % 1)
        turn = 2.0 * math.pi * part + self.drive.phase_rad
        free = (self.modes * np.exp(self.rates * time_s)[:, None]).sum(axis=0)
        return np.asarray((self.steady * complex(math.cos(turn), math.sin(turn)) + free).real)

    def transient_share(self, time_s: float) -> float:
        """Return the ratio of transient to steady motion at a time [s], for x or p, whichever is larger."""
        fading = np.exp(self.rates.real * time_s)
        return max(
            float(np.abs(part) @ fading) / abs(whole) if np.any(part) else 0.0 for part, whole in self._parts
        )

    def decay_time_s(self, share: float) -> float:
        """Return the time at which the transient falls below ``share`` of the steady motion [s], or inf."""
        latest = 0.0
        for part, whole in self._parts:
            size = np.abs(part) * len(part) / (share * abs(whole))
            for one, rate in zip(size, self.rates.real, strict=True):
                if one > 1.0:
                    latest = max(latest, math.log(one) / -rate if rate < 0.0 else math.inf)
        return latest

    @property
    def _parts(self) -> tuple[tuple[Complex, complex], tuple[Complex, complex]]:
        across, along = self.modes[:, X], self.modes[:, Y] - self.modes[:, Z]
        return (across, self.steady_x), (along, self.steady_p)


def linear_motion(specimen: Specimen, drive: Harmonic, start: ArrayLike) -> LinearMotion:
    """Return the linear motion from a start, shape (6,); valid until a stop is touched.

    Raises ValueError when two modes coincide (critical damping) or numbers overflow.
    """
    with np.errstate(all="ignore"):
        form = modal_form(specimen)
        steady, _ = harmonic_motion(specimen, 2.0 * math.pi * drive.frequency_hz, drive.amplitude_m)
        turn = complex(math.cos(drive.phase_rad), math.sin(drive.phase_rad))
        free = np.asarray(start, dtype=np.float64) - (steady * turn).real
        modes = (form.rows @ free)[:, None] * form.shapes
    if not (np.all(np.isfinite(modes)) and np.all(np.isfinite(steady))):
        msg = (
            f"The motion of this specimen under {drive.amplitude_m:g} m at {drive.frequency_hz:g} Hz cannot "
            "be computed: the numbers are too far apart. Correct masses, springs, dampings, drive or start."
        )
        raise ValueError(msg)
    return LinearMotion(drive, form.rates, modes, steady)


def never_touches(specimen: Specimen, motion: LinearMotion) -> bool:
    """Return whether a bound proves that no stop is ever touched."""
    match specimen.contact:
        case NoContact():
            return True
        case PowerLaw():
            return False
        case _:
            return motion.largest_p_m < min(specimen.gaps_m)


DECAYED_SHARE = 1e-9
"""Largest transient, relative to the steady motion, that the closed form may neglect."""

CLOSED_FORM_S = 5e-4
"""Planned computing time for a closed form [s]. Measured run times correct the planned times for each machine
(`vibench.sim.scene.cost`)."""
PERIOD_S, PRESSED_S = 2e-7, 1.2e-2
"""Planned computing time [s] of a drive period without contact, and of one second of contact."""
STEPS_S, STEPS_PERIOD_S = 4e-4, 5e-6
"""Planned computing time [s] per second and per drive period of motion, for a force that acts at every p."""
STIFF, STIFFENING = 0.2, 0.35
"""Ratio of p without stops to the gap, above which a force of degree n needs shorter steps; the exponent of
this ratio is `STIFFENING` (n - 1) / (n + 1), as an oscillator's frequency suggests."""
TANGENT = 1.5
"""Additional computing time for a tangent vector, relative to the time without a tangent vector."""
SETTLING_S = 10.0
"""Planned simulated time of a run with an automatic duration [s]."""
TOUCHING = 0.6
"""Ratio of the steady p without stops to the gap, above which most motions depend sensitively on the start:
135 of 166 random scenes above this ratio, but 15 of 118 below it (`benchmarks/planned_costs.py`)."""
MOST_SHARE = 1e6
IMPACTS_PER_PERIOD = 2.4
"""Number of impacts per drive period if p without stops equals the gap; grows as the cube root of p / gap."""
HALF_PRESSED = 150.0
"""Ratio of p without stops to the gap, at which m1 touches a stop during half of the time."""
MICROMETRES = 1e6


@dataclass(frozen=True)
class ScenePlan:
    """Method and expected computing time of a scene."""

    method: Method
    sentences: tuple[str, ...]
    """Reasons as sentences: what is computed, what is not, and why."""
    planned_s: float
    """Estimated computing time on a nominal reference machine [s]."""
    longest_planned_s: float
    """Estimated computing time if the motion never repeats and an automatic duration has full length [s]."""
    kind: str
    """Kind of run in the cost ledger, ``a/b/c``, from general to special."""
    largest_p_m: float
    """Upper bound on abs(p) without contact [m]."""

    @property
    def batch_key(self) -> tuple[str, ...]:
        """Key of the solution method; scenes that are solved in the same way have equal keys."""
        return (self.method.value, *self.sentences[1:])

    @property
    def cost(self) -> "ExpectedTime":
        """Expected computing time on one core of this machine, from previous runs."""
        from .cost import cost_ledger  # noqa: PLC0415 - reads a file, and few plans need it

        return cost_ledger().expected_time(self.kind, self.planned_s)

    @property
    def cost_s(self) -> float:
        """Expected computing time on one core of this machine, without its uncertainty [s]."""
        return self.cost.time_s

    def explain(self) -> str:
        """Return method, reasons and cost of the scene as text."""
        return "\n".join((*self.sentences, str(self.cost)))


def plan_scene(scene: Scene) -> ScenePlan:
    """Return the plan of a scene; nothing is simulated.

    Raises ValueError when the specimen cannot be simulated.
    """
    return plan_of(scene, linear_motion(scene.specimen, scene.drive, scene.start.state))


def plan_of(scene: Scene, motion: LinearMotion) -> ScenePlan:
    """Return the plan of a scene whose linear motion without contact is ``motion``."""
    method = _method(scene.specimen, motion, scene.duration)
    if method is Method.CLOSED_FORM:
        why = _reason_of_closed_form(scene.specimen, motion)
        return ScenePlan(method, (why,), CLOSED_FORM_S, CLOSED_FORM_S, method.value, motion.largest_p_m)
    if whole_periods(scene.duration.window_s, scene.drive.frequency_hz) > MOST_STATES:
        frequency_hz = scene.drive.frequency_hz
        msg = (
            f"Window {scene.duration.window_s:g} s is not allowed at {frequency_hz:g} Hz: "
            f"a state is stored in each drive period; give {MOST_STATES / frequency_hz:.3g} s or less."
        )
        raise ValueError(msg)
    sentences = (
        _reason_to_integrate(scene.specimen, motion, method),
        *(
            _refinement_texts(scene.duration)
            if scene.target is not None
            else (
                *_observable_texts(scene.observe),
                _length(scene.duration),
                *(() if never_touches(scene.specimen, motion) else (_other_starts(scene.budget_s),)),
            )
        ),
    )
    longest_s = scene.duration.longest_s
    length_s = longest_s if isinstance(scene.duration, FixedDuration) else min(SETTLING_S, longest_s)
    return ScenePlan(
        method,
        sentences,
        _planned_s(scene, motion, length_s),
        _planned_s(scene, motion, longest_s),
        _kind(scene, method, motion),
        motion.largest_p_m,
    )


def _method(specimen: Specimen, motion: LinearMotion, duration: FixedDuration | AutomaticDuration) -> Method:
    match specimen.contact, duration:
        case PowerLaw(), _:
            return Method.POLYNOMIAL
        case _, FixedDuration():
            by_s = duration.duration_s - duration.window_s
        case _, AutomaticDuration():
            by_s = duration.longest_s - 1.0 / motion.drive.frequency_hz
    is_proved = never_touches(specimen, motion) and motion.decay_time_s(DECAYED_SHARE) <= by_s
    return Method.CLOSED_FORM if is_proved else Method.EVENT_DRIVEN


def _reason_of_closed_form(specimen: Specimen, motion: LinearMotion) -> str:
    steady = "The steady motion has a closed form; nothing is integrated in time."
    if specimen.contact.kind == "linear":
        return f"There are no stops. {steady}"
    return (
        f"No stop is touched: abs(p) stays below {motion.largest_p_m * MICROMETRES:.3g} um, including the "
        f"transient, and the gap is {min(specimen.gaps_m) * MICROMETRES:.3g} um. {steady}"
    )


def _reason_to_integrate(specimen: Specimen, motion: LinearMotion, method: Method) -> str:
    if method is Method.POLYNOMIAL:
        return "The force acts at every p: the whole motion is integrated with steps of eight Gauss points."
    largest, gap = motion.largest_p_m * MICROMETRES, min(specimen.gaps_m) * MICROMETRES
    if never_touches(specimen, motion):
        return (
            "No stop is touched, but the transient has not decayed before the window: "
            "the exact linear motion is computed."
        )
    return (
        f"A stop may be touched: without stops abs(p) might reach {largest:.3g} um, "
        f"and the gap is {gap:.3g} um. "
        "Motion between contacts is exact; contacts are integrated to the tolerance of the accuracy level."
    )


def _observable_texts(observe: tuple[Observable, ...]) -> list[str]:
    sentences = [
        "A tangent vector is computed for the exponent."
        if Observable.LYAPUNOV in observe
        else "If the motion does not repeat, a tangent vector is computed to classify the motion."
    ]
    if Observable.SPECTRUM in observe:
        sentences.append("Samples are stored over the window for the spectrum.")
    else:
        sentences.append("Only one state per drive period is stored.")
    if Observable.SCATTER in observe:
        sentences.append(
            f"{FEWEST - 1} more runs, whose starts differ by a millionth of the gap, show the scatter."
        )
    return sentences


def _refinement_texts(duration: FixedDuration | AutomaticDuration) -> tuple[str, ...]:
    return (
        "A second run, whose start differs by a millionth of the gap, has a smaller tolerance.",
        "If the motion approaches a stable periodic motion, Newton's iteration finds that motion exactly.",
        f"Otherwise, both runs are observed over {duration.window_s:g} s and compared.",
        "If the runs separate, the motion is sensitive to its start; the result is a mean over starts.",
        "Starts are added until the target error or time is reached.",
    )


def _other_starts(budget_s: float) -> str:
    if budget_s == 0.0:
        return "Runs from other starts are not computed, because there is no budget."
    return (
        "The start of a second run differs by a millionth of the gap. If the two runs separate, or the "
        f"motion is chaotic, the final motion is random. Then {CLEAR} to {MOST} starts are computed and "
        f"chaos is integrated further, for at most {budget_s:g} s of processor time."
    )


def _length(duration: FixedDuration | AutomaticDuration) -> str:
    window = f"{duration.window_s:g} s"
    match duration:
        case FixedDuration(duration_s=duration_s):
            return f"The motion is computed for {duration_s:g} s; the last {window} are observed."
        case AutomaticDuration(longest_s=longest_s):
            return (
                "The motion is computed until it repeats, "
                f"for at most {longest_s:g} s or {MOST_STATES} drive periods. "
                f"It is observed over one of its periods, or over {window} if it never repeats."
            )


def _kind(scene: Scene, method: Method, motion: LinearMotion) -> str:
    """Return the kind of a run; runs of one kind have a similar ratio of actual to planned time."""
    contact = "touching" if _share(scene, motion) > TOUCHING else "free"
    contact += ", undamped" if motion.slowest_rate >= 0.0 else ""
    duration = "fixed" if isinstance(scene.duration, FixedDuration) else "automatic"
    observed = "+".join(sorted(each.value for each in scene.observe))
    # The kind of run includes the budget, because in chaos, runs from other starts use all of it.
    limit = f"{scene.budget_s:.0e} s" if scene.target is None else str(scene.target)
    law, accuracy = scene.specimen.contact.kind, scene.accuracy.value
    return "/".join((method.value, law, contact, accuracy, duration, observed, limit))


def _planned_s(scene: Scene, motion: LinearMotion, length_s: float) -> float:
    """Return the planned computing time of a motion of this length [s]."""
    run_s = length_s * _planned_per_s(scene, motion)
    runs = 1.0 + (TANGENT if Observable.LYAPUNOV in scene.observe else 0.0)
    runs += FEWEST - 1 if Observable.SCATTER in scene.observe else 0.0
    if scene.budget_s == 0.0 or _share(scene, motion) <= TOUCHING:
        return CLOSED_FORM_S + run_s * (runs + float(scene.budget_s > 0.0))
    return CLOSED_FORM_S + run_s * runs + min(scene.budget_s, (FEWEST - 1) * run_s)


def _planned_per_s(scene: Scene, motion: LinearMotion) -> float:
    """Return the planned computing time of one run for one second of motion [s]."""
    share, frequency_hz, contact = _share(scene, motion), scene.drive.frequency_hz, scene.specimen.contact
    if isinstance(contact, PowerLaw):
        degree = max(exponent for exponent, _ in contact.terms)
        stiffening = max(1.0, share / STIFF) ** (STIFFENING * (degree - 1) / (degree + 1))
        return (STEPS_S + STEPS_PERIOD_S * frequency_hz) * float(stiffening)
    per_s = FLIGHT + PERIOD_S * frequency_hz
    if share > TOUCHING:
        impact_s, _, _ = CONTACTS[contact.kind]
        per_s += impact_s * IMPACTS_PER_PERIOD * math.cbrt(share) * frequency_hz
        per_s += PRESSED_S * share / (share + HALF_PRESSED)
    return per_s


def _share(scene: Scene, motion: LinearMotion) -> float:
    """Return the ratio of the steady p without stops to the smaller gap, at most `MOST_SHARE`."""
    size_m = abs(motion.steady_p)
    return size_m / max(min(scene.specimen.gaps_m), size_m / MOST_SHARE) if size_m > 0.0 else 0.0
