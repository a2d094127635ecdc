"""Every request of the protocol has a message, permitted states, a handler method and a client method."""

import json
from time import monotonic

import pytest

from vibench.acquisition import CheckRule, ConfigurationError, StopLevel
from vibench.acquisition.campaign import PointOutcome
from vibench.acquisition.engine import (
    CampaignRequest,
    Engine,
    EngineClient,
    EngineError,
    EngineState,
    JobQueue,
    RequestHandler,
    Supervision,
)
from vibench.acquisition.engine._server import answer_to
from vibench.acquisition.engine._verbs import VERBS
from vibench.acquisition.engine._wire import Message
from vibench.acquisition.plan import RunState

from .conftest import PATIENCE_S, campaign

WORDS = {
    *("open", "close", "check", "arm", "disarm", "start", "stop"),
    *("resume", "mark", "status", "beat", "look", "shutdown"),
    *("rig", "request", "twin", "tell_twin", "tell_change"),
}
RESTRICTED = {"open", "close", "check", "arm", "start", "mark", "tell_change"}


@pytest.fixture
def handler() -> RequestHandler:
    engine = Engine(Supervision.UNATTENDED)
    return RequestHandler(engine, JobQueue(engine))


def test_the_request_names_of_the_protocol_are_unchanged():
    assert set(VERBS) == WORDS


def test_stopping_and_viewing_are_allowed_in_every_state():
    assert {word for word, verb in VERBS.items() if verb.states} == RESTRICTED


def test_the_client_can_send_every_request():
    for verb in VERBS.values():
        assert hasattr(EngineClient, verb.call.__name__), verb.word


@pytest.mark.parametrize("word", sorted(RESTRICTED - {"open", "close"}))
def test_a_request_that_the_state_does_not_permit_is_refused(handler, word):
    verb = VERBS[word]
    assert EngineState.CLOSED not in verb.states
    arguments = dict.fromkeys(name for name in verb.request.model_fields if name != "ask")
    with pytest.raises(Exception, match=f"is closed and cannot {word} now; it must be "):
        handler.carry_out(verb, arguments)


def test_requests_are_refused_while_the_bench_is_being_closed(shipped_rig):
    """A request between the decision to close and the closing once ended the client's connection."""
    engine = Engine(Supervision.UNATTENDED)
    jobs = JobQueue(engine)
    handler = RequestHandler(engine, jobs)
    engine.open(shipped_rig)
    handler.carry_out(VERBS["close"], {})
    with pytest.raises(EngineError, match="is being closed, so the engine cannot check now"):
        handler.carry_out(VERBS["check"], {})
    jobs.leave()
    jobs.run()
    assert engine.published.state is EngineState.CLOSED
    handler.carry_out(VERBS["open"], {"rig": shipped_rig})
    handler.shutdown()
    with pytest.raises(EngineError, match="is being closed"):
        handler.carry_out(VERBS["close"], {})
    jobs.run()


def test_a_closed_bench_can_be_opened_again_at_once(shipped_rig):
    """The closing thread publishes the state just before it ends; opening in between must succeed."""
    engine = Engine(Supervision.UNATTENDED)
    jobs = JobQueue(engine)
    handler = RequestHandler(engine, jobs)
    engine.open(shipped_rig)
    shown = engine.published.enter

    def enter_and_open(state):
        shown(state)
        if state is EngineState.CLOSED:
            engine.published.enter = shown
            try:
                handler.carry_out(VERBS["open"], {"rig": shipped_rig})
            finally:
                jobs.leave()

    engine.published.enter = enter_and_open
    handler.carry_out(VERBS["close"], {})
    jobs.run()
    told = [each.what for each in engine.published.status().messages]
    assert told.count(f"{shipped_rig.name} is open") == 2


def enforce_deadlines_until(handler, is_over):
    """Enforce the engine's deadlines repeatedly, as its server does, without an attending viewer."""
    give_up_s = monotonic() + PATIENCE_S
    while not is_over():
        assert monotonic() < give_up_s
        handler.enforce_deadlines()


@pytest.mark.thorough
def test_an_armed_run_stays_armed_long_enough_to_be_started(shipped_rig, tmp_path):
    """The deadline begins with arming, also if the viewer has sent no request before."""
    engine = Engine(Supervision.ATTENDED)
    handler = RequestHandler(engine, JobQueue(engine))
    engine.open(shipped_rig)
    deserted_s = monotonic() + 2.0
    enforce_deadlines_until(handler, lambda: monotonic() > deserted_s)
    request = CampaignRequest(campaign=campaign("run"), folder=tmp_path, check=CheckRule.WAIVED)
    handler.carry_out(VERBS["arm"], {"campaign_request": request})
    handler.enforce_deadlines()
    assert engine.published.state is EngineState.ARMED
    enforce_deadlines_until(handler, lambda: engine.published.state is not EngineState.ARMED)
    last = engine.published.status().messages[-1]
    assert (last.what.partition(":")[0], last.done) == ("The viewer was lost", "Disarmed.")
    engine.close()


class InterruptedEngine(Engine):
    """An engine that calls `met_by` when its switch is read, and `arming_met_by` when its bench is read."""

    met_by = arming_met_by = staticmethod(lambda: None)

    @property
    def bench(self):
        self.arming_met_by()
        return super().bench

    @property
    def switch(self):
        found, met_by, self.met_by = self._switch, self.met_by, lambda: None
        met_by()
        return found

    @switch.setter
    def switch(self, switch):
        self._switch = switch


def test_a_stop_that_arrives_while_a_check_starts_reaches_the_check(tmp_path):
    engine = InterruptedEngine(Supervision.UNATTENDED)
    handler = RequestHandler(engine, JobQueue(engine))
    engine.published.enter(EngineState.READY)
    engine.met_by = lambda: handler.carry_out(VERBS["check"], {"folder": tmp_path, "new_reference": False})
    handler.carry_out(VERBS["stop"], {"level": StopLevel.OFF, "reason": "smoke"})
    assert engine.published.state is EngineState.CHECKING
    assert engine.switch.request.reason == "smoke"


def test_a_stop_that_arrives_during_arming_prevents_arming(shipped_rig, tmp_path):
    """A campaign must not start if a stop was requested while it was being armed."""
    engine = InterruptedEngine(Supervision.UNATTENDED)
    handler = RequestHandler(engine, JobQueue(engine))
    engine.open(shipped_rig)
    engine.arming_met_by = lambda: handler.carry_out(
        VERBS["stop"], {"level": StopLevel.RAMP, "reason": "smoke"}
    )
    request = CampaignRequest(campaign=campaign("run"), folder=tmp_path, check=CheckRule.WAIVED)
    with pytest.raises(EngineError, match="a stop was requested while the campaign was being armed"):
        handler.carry_out(VERBS["arm"], {"campaign_request": request})
    assert engine.published.state is EngineState.READY
    engine.close()


@pytest.mark.parametrize(
    ("request_text", "where"),
    [
        ('{"ask": "dance"}', "dance"),
        ('{"ask": "stop", "level": "gently"}', "stop.level"),
        ('{"ask": "mark", "text": ""}', "mark.text"),
        ('{"ask": "look"}', "look.most"),
        ('{"ask": "beat", "loud": true}', "beat.loud"),
    ],
)
def test_an_invalid_request_changes_nothing_and_names_the_error(handler, request_text, where):
    answer = json.loads(answer_to(handler, Message(request_text.encode())).text)
    assert where in answer["refused"]
    assert "nothing was done" in answer["refused"]


def test_an_unknown_stop_level_is_refused_before_sending():
    with pytest.raises(ConfigurationError, match=r"a request to stop: level .*'ramp'"):
        VERBS["stop"].message(level="gently")


def test_requests_and_answers_round_trip(handler):
    assert VERBS["look"].message(most=3).text == b'{"ask":"look","since_sample":0,"most":3}'
    assert VERBS["stop"].message(level="ramp").text == (
        b'{"ask":"stop","level":"ramp","reason":"stopped by the operator"}'
    )
    assert answer_to(handler, VERBS["beat"].message()).text == b'{"ok": true}'
    looked = answer_to(handler, VERBS["look"].message(most=3))
    assert json.loads(looked.text).keys() == {"run_id", "first_sample", "sample_rate_hz", "shape"}


@pytest.mark.thorough
def test_holding_a_drive_that_cannot_be_held_is_refused(shipped_rig, tmp_path):
    """A run with a dead man's switch cannot be held; a confirmed hold would end it as complete."""
    generator = shipped_rig.generator.model_copy(update={"dead_man_s": 1.0})
    engine, refusals = Engine(Supervision.UNATTENDED), []
    handler = RequestHandler(engine, JobQueue(engine))
    engine.open(shipped_rig.model_copy(update={"generator": generator}))
    tell = engine.published.note_progress

    def hold(progress, bench):
        tell(progress, bench)
        if progress.run.state is RunState.RECORDING and not refusals:
            with pytest.raises(EngineError, match=r"cannot be held\. The run continues; stop") as refused:
                handler.carry_out(VERBS["stop"], {"level": StopLevel.HOLD})
            refusals.append(refused)

    engine.published.note_progress = hold
    request = CampaignRequest(campaign=campaign("m", duration_s=1.0), folder=tmp_path, check=CheckRule.WAIVED)
    (point,) = engine.measure(request)
    assert refusals
    assert point.outcome is PointOutcome.RECORDED
    engine.close()


def test_a_run_that_cannot_be_held_counts_as_stopped(shipped_rig, tmp_path):
    generator = shipped_rig.generator.model_copy(update={"dead_man_s": 1.0})
    engine = Engine(Supervision.UNATTENDED)
    engine.open(shipped_rig.model_copy(update={"generator": generator}))
    engine.switch.hold()  # before the run, when the engine cannot know that the run cannot be held
    request = CampaignRequest(campaign=campaign("m", duration_s=1.0), folder=tmp_path, check=CheckRule.WAIVED)
    (point,) = engine.measure(request)
    assert point.outcome is PointOutcome.STOPPED
    assert engine.switch.request is not None
    ended = json.loads((tmp_path / f"{request.campaign.name}.log.jsonl").read_text().splitlines()[-1])
    assert ended["why"] == "stopped"
    engine.close()
