"""Jobs in other processes: streamed parts, dropped jobs, time limits, and the end of a process."""

import os
import pickle
import subprocess
import sys
import time
from contextlib import closing
from math import factorial
from pathlib import Path
from threading import Barrier, Thread

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
        # The pipe ends only when the program and all its workers have ended.
        assert killed.stdout.read() == "True\n"


@pytest.fixture
def pool():
    pool = Pool(1, longest_s=2.0)
    yield pool
    pool.close()


@pytest.fixture
def patient_pool():
    """A pool whose time limit is long enough for a slow start of its process."""
    pool = Pool(1, longest_s=60.0)
    yield pool
    pool.close()


def poll_until(pool, is_there):
    while not is_there():
        pool.poll(0.1)


def count(until, tell, cancelled):
    """Job that streams numbers until it is cancelled."""
    number = 0
    while number < until and not cancelled():
        tell(number)
        number += 1
        time.sleep(0.0)


def ignore_cancellation(path, tell, _cancelled):
    tell(os.getpid())
    while True:
        time.sleep(0.1)


def test_streamed_parts_arrive_in_order_before_the_end(pool):
    heard = []
    job = pool.stream(count, heard.append, heard.append, heard.append, 2000)
    poll_until(pool, lambda: job.is_over)
    assert heard == [*range(2000), None]


def test_a_dropped_stream_ends_and_its_process_runs_the_next_job(pool):
    heard, answers = [], []
    job = pool.stream(count, heard.append, heard.append, heard.append, 10**9)
    poll_until(pool, lambda: heard)
    job.drop()
    known = len(heard)
    (worker,) = pool.workers
    pool.ask(os.getpid, answers.append, answers.append)
    poll_until(pool, lambda: answers)
    assert answers == [worker.process.pid]
    assert len(heard) == known
    assert job.is_over
    assert not job.is_answered


@pytest.mark.thorough
def test_the_process_of_a_dropped_stream_that_does_not_end_is_terminated(pool):
    heard, answers = [], []
    job = pool.stream(ignore_cancellation, heard.append, heard.append, heard.append, "")
    poll_until(pool, lambda: heard)
    job.drop()
    pool.ask(os.getpid, answers.append, answers.append)
    poll_until(pool, lambda: answers)
    assert answers != heard


@pytest.mark.thorough
def test_jobs_have_a_time_limit_and_streams_do_not():
    errors, heard = [], []
    with closing(Pool(1, longest_s=0.3)) as pool:
        pool.ask(time.sleep, errors.append, errors.append, 3600.0)
        poll_until(pool, lambda: errors)
        assert isinstance(errors[0], TimeoutError)
        pool.stream(ignore_cancellation, heard.append, heard.append, errors.append, "")
        poll_until(pool, lambda: heard)
        began_s = time.monotonic()
        poll_until(pool, lambda: time.monotonic() - began_s > 0.6)
        assert len(errors) == 1


def lambda_of(_number):
    return lambda: None


class Unpicklable(Exception):
    """Exception that cannot be restored from its pickle."""

    def __init__(self, one, two):
        super().__init__(one)
        self.two = two


def odd(_number):
    raise Unpicklable(1, 2)


@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
@pytest.mark.parametrize("function", [lambda_of, odd])
def test_a_result_that_cannot_be_pickled_is_an_error_and_the_next_job_runs(patient_pool, function):
    errors, answers = [], []
    patient_pool.ask(function, answers.append, errors.append, 0)
    poll_until(patient_pool, lambda: errors)
    assert isinstance(errors[0], (pickle.PicklingError, AttributeError, ChildProcessError))
    patient_pool.ask(factorial, answers.append, errors.append, 5)
    poll_until(patient_pool, lambda: answers)
    assert answers == [120]


def leave(_number):
    os._exit(1)


def test_a_callback_may_close_its_process_pool(patient_pool):
    errors = []
    patient_pool.ask(leave, errors.append, lambda error: (errors.append(error), patient_pool.close()), 0)
    poll_until(patient_pool, lambda: errors)
    assert "has ended" in str(errors[0])
    assert not patient_pool.workers
    assert patient_pool.ask(factorial, errors.append, errors.append, 3).is_over
    patient_pool.poll()
    assert len(errors) == 1


def heaps_of_threads(_number):
    """Return how many parts of memory glibc has reserved as further heaps (64 MB each, mostly unused)."""
    barrier = Barrier(4)
    threads = [Thread(target=lambda: (bytearray(10_000), barrier.wait())) for _ in range(4)]
    for each in threads:
        each.start()
    for each in threads:
        each.join()
    lines = [each.split() for each in Path("/proc/self/maps").read_text().splitlines()]
    spans = [[int(end, 16) for end in words[0].split("-")] for words in lines if words[1] == "---p"]
    return sum(60 << 20 < stop - start < 64 << 20 for start, stop in spans)


@pytest.mark.skipif(sys.platform != "linux", reason="only glibc has further heaps")
def test_all_threads_of_a_background_process_use_one_heap(patient_pool):
    answers = []
    patient_pool.ask(heaps_of_threads, answers.append, answers.append, 1)
    poll_until(patient_pool, lambda: answers)
    assert answers == [0]
