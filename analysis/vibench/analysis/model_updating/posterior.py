"""Numbers of a model from statistics of its runs: approximate Bayesian computation with regression.

Parameters are drawn from a box, a run is made of each, and every parameter is regressed on the statistics of
the runs (Beaumont, Zhang and Balding 2002; Fearnhead and Prangle 2012). What the regression says of the
observed statistics, with the errors that it makes of draws left out one at a time, is the posterior; its
intervals hold as often as they say for parameters of the box, however rough the regression is (conformal
prediction; Vovk, Gammerman and Shafer 2005). The box is then cut to where the parameters can be, and drawn
from again (Deistler, Goncalves and Macke 2022).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ..signals.arrays import Reals

ROUNDS = (120, 120, 240)
"""Runs that each box holds."""
_MARGIN = 1.25
"""Of the largest error of a regression, within which a parameter is looked for in the next box."""
_RIDGES = np.geomspace(1e-4, 1e4, 25)
_COMPONENTS = 15
"""Of the statistics' scatter, by which observed ones are checked against those of runs."""
_FAR = 1.05
"""Observed statistics this many times as far from the model as those of the furthest run are not its.

Those of the model are further than the furthest of n runs once in n + 1 times at most; a little leeway is for
what rig and recording differ in besides. It refuses as 1.25 did where runs were also compared with
themselves.
"""

Runs = Callable[[Reals], Reals]
"""Statistics, shape (draws, statistics), of runs with the given parameters, shape (draws, parameters)."""


@dataclass(frozen=True, eq=False)
class Posterior:
    """What observed statistics say of parameters."""

    draws: Reals
    """Shape (draws, parameters)."""
    distance: float
    """Of the observed statistics from those of runs, over that of the furthest run."""

    @property
    def fits(self) -> bool:
        """Whether the observed statistics could be those of a run."""
        return self.distance <= _FAR


def posterior(
    runs: Runs, observed: Reals, box: Reals, seed: int, rounds: Sequence[int] = ROUNDS
) -> Posterior:
    """Draw, run, regress, and cut the box, round by round.

    Parameters
    ----------
    runs
        Makes runs.
    observed
        Statistics of what was observed, shape (statistics,).
    box
        Least and largest of each parameter, shape (parameters, 2): all in it is as likely before.
    seed
        Of the drawing.
    rounds
        How many runs each box holds.

    """
    rng = np.random.default_rng(seed)
    parameters, statistics = np.empty((0, len(box))), np.empty((0, observed.size))
    for wanted in rounds:
        inside = np.all((parameters >= box[:, 0]) & (parameters <= box[:, 1]), axis=1)
        parameters, statistics = parameters[inside], statistics[inside]
        new = rng.uniform(box[:, 0], box[:, 1], (wanted - len(parameters), len(box)))
        # A box that nothing has narrowed holds them all.
        if len(new):
            parameters = np.concatenate([parameters, new])
            statistics = np.concatenate([statistics, runs(new)])
        middle, errors = _regressed(statistics, parameters, observed)
        reach = _MARGIN * np.abs(errors).max(axis=0)
        narrower = np.clip(np.stack([middle - reach, middle + reach], axis=1), box[:, :1], box[:, 1:])
        found = np.clip(middle + errors, box[:, 0], box[:, 1])
        guessed = np.vstack([parameters - errors, middle])
        box = narrower
    return Posterior(found, _distance(guessed, statistics, observed))


def _regressed(statistics: Reals, parameters: Reals, observed: Reals) -> tuple[Reals, Reals]:
    """Give parameters (n,) of observed statistics, and errors of draws left out one at a time, (draws, n)."""
    middle, scale = statistics.mean(axis=0), statistics.std(axis=0) + 1e-12
    u, sizes, vt = np.linalg.svd((statistics - middle) / scale, full_matrices=False)
    new = vt @ ((observed - middle) / scale)
    mean = parameters.mean(axis=0)
    found, errors = np.empty(parameters.shape[1]), np.empty(parameters.shape)
    for n, target in enumerate((parameters - mean).T):
        tried = [_left_out(u, sizes, target, ridge) for ridge in _RIDGES]
        best = int(np.argmin([np.sum(each**2) for each in tried]))
        errors[:, n] = tried[best]
        weight = sizes / (sizes**2 + _RIDGES[best])
        found[n] = mean[n] + (weight * (u.T @ target)) @ new
    return found, errors


def _left_out(u: Reals, sizes: Reals, target: Reals, ridge: float) -> Reals:
    """Errors of a ridge regression of draws that it does not know, in closed form."""
    shrunk = sizes**2 / (sizes**2 + ridge)
    fitted = (u * shrunk) @ (u.T @ target)
    leverage = np.sum(u**2 * shrunk, axis=1) + 1 / len(target)
    return np.asarray((target - fitted) / (1 - leverage))


def _distance(parameters: Reals, statistics: Reals, observed: Reals) -> float:
    """Return how far observed statistics lie from what parameters give, over the furthest run's own.

    Without what the parameters that a regression finds explain, along the largest components of the rest and
    beyond them. Each run is checked against the others, as the observed statistics are against all: a run
    that had a part in its own reference would seem nearer than it is, the more so the fewer there are.

    Parameters
    ----------
    parameters
        As the regression finds them, those of the observed in the last row, shape (draws + 1, parameters).
    statistics
        Of runs, shape (draws, statistics).
    observed
        Shape (statistics,).

    """
    size = (parameters - parameters[:-1].mean(axis=0)) / (parameters[:-1].std(axis=0) + 1e-12)
    terms = np.column_stack([np.ones(len(size)), size, size**2])
    values = np.vstack([statistics, observed]) / (statistics.std(axis=0) + 1e-12)
    seen = _far(terms[:-1], values[:-1], terms[-1], values[-1])
    furthest = np.zeros(2)
    for number in range(len(statistics)):
        others = np.arange(len(statistics)) != number
        own = _far(terms[:-1][others], values[:-1][others], terms[number], values[number])
        furthest = np.maximum(furthest, own)
    return float(np.sqrt(np.max(seen / furthest)))


def _far(terms: Reals, values: Reals, own_terms: Reals, own_values: Reals) -> Reals:
    """Square distances of a run from others, shapes (terms,), (statistics,): along components and beyond."""
    known, *_ = np.linalg.lstsq(terms, values, rcond=None)
    _, spread, axes = np.linalg.svd(values - terms @ known, full_matrices=False)
    rest = own_values - own_terms @ known
    along = axes[:_COMPONENTS] @ rest
    beyond = rest - along @ axes[:_COMPONENTS]
    return np.array([np.sum((along / spread[:_COMPONENTS]) ** 2), np.sum(beyond**2)])
