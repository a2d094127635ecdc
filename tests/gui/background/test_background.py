"""Background processes: they return answers and errors, and dropped requests return nothing."""

import os
import re
import signal
import sys
from math import factorial
from pathlib import Path
from time import sleep

import pytest

from vibench.gui.background import Background, LatestRequest


def test_background_errors_keep_their_type_and_dropped_results_are_discarded(context, qtbot):
    answers, errors = [], []
    context.background.ask(factorial, answers.append, errors.append, 5).drop()
    context.background.ask(factorial, answers.append, errors.append, -1)
    # The process with the dropped request may be the later one.
    qtbot.waitUntil(lambda: bool(errors) and not context.background.is_busy, timeout=100_000)
    assert isinstance(errors[0], ValueError)
    assert answers == []


def leave(_number):
    """End the worker process without an answer."""
    os._exit(1)


@pytest.fixture
def background(qapp):
    background = Background(1)
    yield background
    background.close()


def test_a_dead_process_is_reported_and_other_processes_finish_its_queue(background, qtbot):
    answers, errors = [], []
    background.ask(leave, answers.append, errors.append, 0)
    dropped = [background.ask(factorial, answers.append, errors.append, 3) for _ in range(5)]
    for job in dropped:
        job.drop()
    background.ask(factorial, answers.append, errors.append, 5)
    qtbot.waitUntil(lambda: answers == [120], timeout=100_000)
    assert [type(error) for error in errors] == [ChildProcessError]
    assert not background.is_busy


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no SIGSTOP")
def test_closing_ends_an_unresponsive_process(background, qtbot):
    pids = []
    background.ask(os.getpid, pids.append, pids.append)
    qtbot.waitUntil(lambda: bool(pids), timeout=100_000)
    os.kill(pids[0], signal.SIGSTOP)
    waiting = [background.ask(factorial, pids.append, pids.append, 5) for _ in range(5)]
    waiting[0].drop()
    background.close()
    with pytest.raises(ProcessLookupError):
        os.kill(pids[0], 0)


def large(path):
    """Return an answer larger than any pipe buffer."""
    Path(path).write_text("")
    return bytes(300 << 20)


def is_being_read(thread):
    """Return whether the receiving thread has read the beginning of an answer and waits for the rest."""
    frame = sys._current_frames().get(thread.ident)
    while frame is not None and frame.f_code.co_name != "_recv":
        frame = frame.f_back
    return frame is not None and frame.f_locals.get("remaining", 0) > 1 << 20


@pytest.mark.thorough
@pytest.mark.timeout(60)
def test_closing_ends_a_process_that_is_sending_its_result(background, qtbot, tmp_path):
    """The window waited for ever for the rest of an answer."""
    background.ask(large, lambda _: None, lambda _: None, str(tmp_path / "begun"))
    qtbot.waitUntil((tmp_path / "begun").exists, timeout=100_000)
    (worker,) = background.workers
    thread = worker._thread
    while not is_being_read(thread):
        assert thread.is_alive()
    background.close()
    assert not thread.is_alive()


def for_ever(path):
    """Report the number of the process, and never return."""
    Path(path).write_text(str(os.getpid()))
    while True:
        pass


def hungry(_number):
    return bytearray(8 << 30)


def test_a_request_after_a_dropped_request_is_answered(background, qtbot, qapp):
    answers, errors = [], []
    latest = LatestRequest(background, factorial, answers.append, errors.append, 1, qapp)
    for number in (3, 4):
        latest.ask(number)
        qtbot.waitUntil(lambda: latest._job is not None, timeout=100_000)
        latest.drop()
        assert not latest.is_busy
    latest.ask(5)
    qtbot.waitUntil(lambda: bool(answers or errors), timeout=100_000)
    assert (answers, errors) == ([120], [])
    assert not latest.is_busy


@pytest.mark.thorough
def test_a_process_busy_with_a_dropped_request_is_ended_and_the_next_request_runs(
    background, qtbot, qapp, tmp_path
):
    answers, errors = [], []
    latest = LatestRequest(background, for_ever, answers.append, errors.append, 1, qapp)
    latest.ask(str(tmp_path / "pid"))
    qtbot.waitUntil((tmp_path / "pid").exists, timeout=100_000)
    background.ask(factorial, answers.append, errors.append, 5)
    latest.drop()
    qtbot.waitUntil(lambda: answers == [120], timeout=100_000)
    assert errors == []
    pid = int((tmp_path / "pid").read_text())
    qtbot.waitUntil(lambda: not Path(f"/proc/{pid}").exists(), timeout=5000)


def test_the_memory_of_a_worker_process_is_limited(background, qtbot):
    answers, errors = [], []
    background.ask(hungry, answers.append, errors.append, 0)
    qtbot.waitUntil(lambda: bool(answers or errors), timeout=100_000)
    assert re.search(r"needs more than 6 GB of memory", str(errors[0]))


def test_a_job_counts_as_ended_only_after_its_result_was_delivered(background, qtbot):
    answers, seen = [], []

    def take(answer):
        seen.append([job.is_over for job in jobs])
        answers.append(answer)

    jobs = [background.ask(factorial, take, answers.append, number) for number in (3, 4)]
    qtbot.waitUntil(lambda: answers == [6, 24], timeout=100_000)
    assert seen == [[True, False], [True, True]]


def test_previews_are_computed_while_all_other_processes_are_busy(context, qtbot):
    """The Test page waited for analyses that took minutes."""
    for _ in range(4):
        context.background.ask(sleep, lambda _: None, lambda _: None, 3600.0)
    answers = []
    context.looks.ask(abs, answers.append, answers.append, -2)
    qtbot.waitUntil(lambda: answers == [2], timeout=100_000)
    context.background.close()
    assert not context.looks.is_busy
