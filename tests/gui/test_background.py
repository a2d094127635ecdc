"""Work in another process: its answer and its error come back, and what is dropped stays away."""

import os
from math import factorial


def test_an_answer_comes_from_another_process(desk, qtbot):
    answers, errors = [], []
    desk.background.ask(os.getpid, answers.append, errors.append)
    qtbot.waitUntil(lambda: bool(answers or errors), timeout=20_000)
    assert errors == []
    assert answers[0] != os.getpid()


def test_an_error_comes_back_as_itself_and_a_dropped_answer_does_not(desk, qtbot):
    answers, errors = [], []
    desk.background.ask(factorial, answers.append, errors.append, 5).drop()
    desk.background.ask(factorial, answers.append, errors.append, -1)
    qtbot.waitUntil(lambda: bool(errors), timeout=20_000)
    assert isinstance(errors[0], ValueError)
    assert answers == []
    assert not desk.background.is_busy
