"""Unlimited messages and requests use limited memory in a simulated generator."""

import pytest

from vibench.virtual_rig.generator.afg1022 import AFG1022
from vibench.virtual_rig.generator.scpi_instrument import LONGEST_REPLY


@pytest.fixture
def afg():
    return AFG1022(lambda: 0.0)


def reply_to(generator, message):
    return generator.execute(message).data


def test_a_message_with_too_many_queries_loses_its_answers_and_queues_error_minus_430(afg):
    query = b"DATA:DATA? EMEM"
    one = len(reply_to(afg, query))
    many = LONGEST_REPLY // one
    assert len(reply_to(afg, b";:".join([query] * many))) >= many * (one - 1)
    assert reply_to(afg, b";:".join([query] * 20 * many) + b";:FREQ 77") == b""
    assert reply_to(afg, b"SYST:ERR?").startswith(b"-430")
    assert reply_to(afg, b"SYST:ERR?").startswith(b"0,"), "told once"
    assert float(reply_to(afg, b"FREQ?")) == 77
    assert reply_to(afg, b"*IDN?").startswith(b"TEKTRONIX")
