"""A second process that analyses each recording while the next one is measured."""

import shlex
import signal
from collections.abc import Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing import get_context
from pathlib import Path

from vibench.acquisition import follow_parent
from vibench.analysis import AnalysisError, CampaignResults, analyse_files, merged_results


class Analyst:
    """Takes recordings as they are finished, and gives their results in the same order."""

    def __init__(self, pool: ProcessPoolExecutor, name: str, draws: int) -> None:
        self._pool = pool
        self._draws = draws
        self._name = name
        self._folder = Path()
        self._parts: list[Future[CampaignResults]] = []

    def take(self, recording: Path) -> None:
        """Analyse this one next; that this cannot be done is said by `results`: what is measured goes on."""
        try:
            part = self._pool.submit(analyse_files, [recording], self._name, draws=self._draws)
        except BrokenProcessPool as error:
            part = Future()
            part.set_exception(error)
        self._folder = recording.parent
        self._parts.append(part)

    @property
    def asked(self) -> int:
        """Recordings taken so far."""
        return len(self._parts)

    def results(self) -> Iterator[CampaignResults]:
        """Give the results one by one; waits for those that are not ready.

        Raises AnalysisError when the process ended before it was done.
        """
        try:
            for part in self._parts:
                yield part.result()
        except BrokenProcessPool as error:
            raise AnalysisError(
                "the process that analyses has ended (somebody ended it, or memory was short); every "
                f"recording is kept: vibench analyse {shlex.quote(str(self._folder))}"
            ) from error

    def together(self) -> CampaignResults:
        """Give the results as one campaign's."""
        return merged_results(self._name, tuple(self.results()))


@contextmanager
def second_process(name: str, draws: int) -> Iterator[Analyst]:
    """Keep an analyst at work while inside; what it has not begun when an error leaves is dropped."""
    # A fresh interpreter: a fork would copy the threads' locks of the instrument libraries.
    pool = ProcessPoolExecutor(1, mp_context=get_context("spawn"), initializer=_follow)
    try:
        yield Analyst(pool, name, draws)
    finally:
        pool.shutdown(cancel_futures=True)


def _follow() -> None:
    """Leave Ctrl-C to the command, and end with it."""
    follow_parent()
    signal.signal(signal.SIGINT, signal.SIG_IGN)
