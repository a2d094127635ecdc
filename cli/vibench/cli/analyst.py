"""A second process that analyses each recording while the next one is measured."""

import shlex
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from vibench.analysis import AnalysisError, CampaignResults, analyse_files, merged_results
from vibench.sim.background import Pool

LOOK_S = 1.0


class Analyst:
    """Takes recordings as they are finished, and gives their results in the same order."""

    def __init__(self, pool: Pool, name: str, draws: int) -> None:
        self._pool = pool
        self._draws = draws
        self._name = name
        self._folder = Path()
        self._parts: list[CampaignResults | BaseException] = []
        self.asked = 0
        """Recordings taken so far."""

    def take(self, recording: Path) -> None:
        """Analyse this one next."""
        self.asked += 1
        self._folder = recording.parent
        take = self._parts.append
        self._pool.ask(analyse_files, take, take, [recording], self._name, draws=self._draws)
        self._pool.poll()

    def results(self) -> Iterator[CampaignResults]:
        """Yield the results one by one; waits for those that are not ready.

        Raises AnalysisError when the process ended before it was done.
        """
        for number in range(self.asked):
            while number == len(self._parts):
                self._pool.poll(LOOK_S)
            match self._parts[number]:
                case ChildProcessError() as error:
                    raise AnalysisError(
                        "the process that analyses has ended (somebody ended it, or memory was short); every "
                        f"recording is kept: vibench analyse {shlex.quote(str(self._folder))}"
                    ) from error
                case BaseException() as error:
                    raise error
                case results:
                    yield results

    def together(self) -> CampaignResults:
        """Return the results as one campaign's."""
        return merged_results(self._name, tuple(self.results()))


@contextmanager
def second_process(name: str, draws: int) -> Iterator[Analyst]:
    """Keep an analyst at work while inside; what it has not done when an error leaves is dropped."""
    pool = Pool(1)
    try:
        yield Analyst(pool, name, draws)
    finally:
        pool.close()
