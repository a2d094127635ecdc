import os
import signal

import pytest

from vibench.analysis import AnalysisError
from vibench.cli.demo import analysis_processes


def test_a_dead_analysis_process_is_reported_and_does_not_end_the_measurement(tmp_path):
    recording = tmp_path / "of today" / "dwell.h5"
    with analysis_processes("campaign", 5) as analyst:
        analyst.take(recording)
        (worker,) = analyst._pool.workers
        os.kill(worker.process.pid, signal.SIGTERM)
        with pytest.raises(AnalysisError, match=r"every recording is kept.*: vibench analyse '.*of today'"):
            list(analyst.results())
        analyst.take(recording)
        assert analyst.submitted == 2
