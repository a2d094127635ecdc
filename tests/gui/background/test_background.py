"""Work in another process: its answer and its error come back, and what is dropped stays away."""

import os
import signal
import sys
from concurrent.futures.process import BrokenProcessPool
from math import factorial

import pytest

from vibench.gui.background import Background


def test_an_answer_comes_from_another_process(context, qtbot):
    answers, errors = [], []
    context.background.ask(os.getpid, answers.append, errors.append)
    qtbot.waitUntil(lambda: bool(answers or errors), timeout=20_000)
    assert errors == []
    assert answers[0] != os.getpid()


def test_an_error_comes_back_as_itself_and_a_dropped_answer_does_not(context, qtbot):
    answers, errors = [], []
    context.background.ask(factorial, answers.append, errors.append, 5).drop()
    context.background.ask(factorial, answers.append, errors.append, -1)
    qtbot.waitUntil(lambda: bool(errors), timeout=20_000)
    assert isinstance(errors[0], ValueError)
    assert answers == []
    assert not context.background.is_busy


def leave(_number):
    """End the process that was asked, without a word."""
    os._exit(1)


@pytest.fixture
def background(qapp):
    background = Background(1)
    yield background
    background.close()


def test_a_process_that_dies_is_told_and_others_do_what_is_left(background, qtbot):
    answers, errors = [], []
    background.ask(leave, answers.append, errors.append, 0)
    dropped = [background.ask(factorial, answers.append, errors.append, 3) for _ in range(5)]
    for job in dropped:
        job.drop()
    background.ask(factorial, answers.append, errors.append, 5)
    qtbot.waitUntil(lambda: answers == [120], timeout=20_000)
    assert [type(error) for error in errors] == [BrokenProcessPool]
    assert not background.is_busy


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no SIGSTOP")
def test_closing_ends_a_process_that_does_not_answer(background, qtbot):
    pids = []
    background.ask(os.getpid, pids.append, pids.append)
    qtbot.waitUntil(lambda: bool(pids), timeout=20_000)
    os.kill(pids[0], signal.SIGSTOP)
    waiting = [background.ask(factorial, pids.append, pids.append, 5) for _ in range(5)]
    waiting[0].drop()
    background.close()
    with pytest.raises(ProcessLookupError):
        os.kill(pids[0], 0)
