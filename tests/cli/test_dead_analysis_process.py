import os
import signal
from contextlib import closing

import pytest

from vibench.analysis import AnalysisError
from vibench.cli.demo import PROCESSES, Analyst
from vibench.sim.background import Pool


def test_a_dead_analysis_process_is_reported_and_does_not_end_the_measurement(tmp_path):
    recording = tmp_path / "of today" / "dwell.h5"
    with closing(Pool(PROCESSES)) as pool:
        analyst = Analyst(pool, "campaign", 5)
        while pool.is_busy:  # until the processes have started
            pool.poll(1.0)
        for worker in pool.workers:
            os.kill(worker.process.pid, signal.SIGSTOP)
        analyst.take(recording)
        (busy,) = (worker for worker in pool.workers if worker.job is not None)
        os.kill(busy.process.pid, signal.SIGKILL)
        with pytest.raises(AnalysisError, match=r"every recording is kept.*: vibench analyse '.*of today'"):
            list(analyst.results())
        analyst.take(recording)
        assert analyst.submitted == 2
