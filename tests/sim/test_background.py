"""Work in other processes: parts of answers, dropped jobs, bounds, and the end of a process."""

import os
import pickle
import subprocess
import sys
import time
from math import factorial

import pytest

from vibench.sim.background import Pool

PROGRAM = """
import os, signal, time
from vibench.sim.background import Pool

if __name__ == "__main__":
    answers, pool = [], Pool(2)
    pool.ask(os.getpid, answers.append, answers.append)
    while not answers:
        pool.poll(1.0)
    pool.ask(time.sleep, print, print, 3600.0)
    print(answers[0] != os.getpid(), flush=True)
    os.kill(os.getpid(), signal.SIGKILL)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no SIGKILL")
def test_idle_and_busy_processes_end_when_their_program_is_killed(tmp_path):
    script = tmp_path / "program.py"
    script.write_text(PROGRAM)
    with subprocess.Popen([sys.executable, str(script)], stdout=subprocess.PIPE, text=True) as killed:
        # The end comes when nobody holds the other side of the pipe any more, no worker either.
        assert killed.stdout.read() == "True\n"


@pytest.fixture
def pool():
    pool = Pool(1, longest_s=2.0)
    yield pool
    pool.close()


@pytest.fixture
def patient_pool():
    """For answers that do not end by time, also where a process takes seconds to start."""
    pool = Pool(1, longest_s=60.0)
    yield pool
    pool.close()


def polled(pool, is_there):
    while not is_there():
        pool.poll(0.1)


def count(until, tell, cancelled):
    """Tell numbers until they are told to stop."""
    number = 0
    while number < until and not cancelled():
        tell(number)
        number += 1
        time.sleep(0.0)


def deaf(path, tell, _cancelled):
    tell(os.getpid())
    while True:
        time.sleep(0.1)


def test_streamed_parts_arrive_in_order_before_the_end(pool):
    heard = []
    job = pool.stream(count, heard.append, heard.append, heard.append, 2000)
    polled(pool, lambda: job.is_over)
    assert heard == [*range(2000), None]


def test_a_dropped_stream_ends_and_its_process_runs_the_next_job(pool):
    heard, answers = [], []
    job = pool.stream(count, heard.append, heard.append, heard.append, 10**9)
    polled(pool, lambda: heard)
    job.drop()
    known = len(heard)
    (worker,) = pool.workers
    pool.ask(os.getpid, answers.append, answers.append)
    polled(pool, lambda: answers)
    assert answers == [worker.process.pid]
    assert len(heard) == known
    assert job.is_over
    assert not job.is_answered


@pytest.mark.thorough
def test_the_process_of_a_dropped_stream_that_does_not_end_is_terminated(pool):
    heard, answers = [], []
    job = pool.stream(deaf, heard.append, heard.append, heard.append, "")
    polled(pool, lambda: heard)
    job.drop()
    pool.ask(os.getpid, answers.append, answers.append)
    polled(pool, lambda: answers)
    assert answers != heard


@pytest.mark.thorough
def test_jobs_have_a_time_limit_and_streams_do_not(pool):
    errors, heard = [], []
    pool.ask(time.sleep, errors.append, errors.append, 3600.0)
    polled(pool, lambda: errors)
    assert isinstance(errors[0], TimeoutError)
    pool.stream(deaf, heard.append, heard.append, errors.append, "")
    polled(pool, lambda: heard)
    began_s = time.monotonic()
    polled(pool, lambda: time.monotonic() - began_s > 2.5)
    assert len(errors) == 1


def lambda_of(_number):
    return lambda: None


class Odd(Exception):
    """Cannot be made from what it was pickled as."""

    def __init__(self, one, two):
        super().__init__(one)
        self.two = two


def odd(_number):
    raise Odd(1, 2)


@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
@pytest.mark.parametrize("function", [lambda_of, odd])
def test_a_result_that_cannot_be_pickled_is_an_error_and_the_next_job_runs(patient_pool, function):
    errors, answers = [], []
    patient_pool.ask(function, answers.append, errors.append, 0)
    polled(patient_pool, lambda: errors)
    assert isinstance(errors[0], (pickle.PicklingError, AttributeError, ChildProcessError))
    patient_pool.ask(factorial, answers.append, errors.append, 5)
    polled(patient_pool, lambda: answers)
    assert answers == [120]


def leave(_number):
    os._exit(1)


def test_a_callback_may_close_its_process_pool(pool):
    errors = []
    pool.ask(leave, errors.append, lambda error: (errors.append(error), pool.close()), 0)
    polled(pool, lambda: errors)
    assert "has ended" in str(errors[0])
    assert not pool.workers
    assert pool.ask(factorial, errors.append, errors.append, 3).is_over
    pool.poll()
    assert len(errors) == 1
