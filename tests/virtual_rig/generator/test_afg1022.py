import math
from dataclasses import replace

import pytest

from vibench.virtual_rig.generator.afg1022 import AFG1022
from vibench.virtual_rig.generator.channel_output import MODULATIONS
from vibench.virtual_rig.generator.scpi_instrument import Quirks

PLAIN = Quirks(
    first_identity_after_clear_is_empty=False,
    high_impedance_has_ohm_sign=False,
    unknown_is_syntax_error=False,
    out_of_range_becomes_default=False,
)


def generator(*messages, **quirks):
    """Return a generator after these messages, with no quirks except the given ones."""
    device = AFG1022(lambda: 0.0, quirks=replace(PLAIN, **quirks))
    for message in messages:
        device.execute(message)
    return device


def ask(device, message):
    return device.execute(message.encode()).data.decode("ascii").removesuffix("\n")


def errors(device):
    """Every queued error number, oldest first."""
    found = []
    while (code := int(ask(device, "SYST:ERR?").partition(",")[0])) != 0:
        found.append(code)
    return found


@pytest.mark.parametrize(
    ("command", "query", "answer"),
    [
        ("OUTP1:STAT ON", "OUTP1:STAT?", "1"),
        ("OUTPUT2 ON", "OUTP2:STAT?", "1"),
        ("OUTP1:STAT 0", "OUTP1?", "0"),
        ("OUTP1:IMP INF", "OUTP1:IMP?", "9.9E+37"),
        ("OUTP1:IMP 600", "OUTP1:IMP?", "6.0E+02"),
        ("SOUR1:FUNC:SHAP SQU", "SOUR1:FUNC?", "SQU"),
        ("func sinusoid", "FUNC:SHAPE?", "SIN"),
        ("SOUR2:FUNC:SHAP RAMP", "SOUR2:FUNC:SHAP?", "RAMP"),
        ("FUNC PULSE", "FUNC?", "PULS"),
        ("FUNC PRN", "FUNC?", "PRN"),
        ("FUNC DC", "FUNC?", "DC"),
        ("FUNC EMEM", "FUNC?", "EMEM"),
        ("SOUR1:FREQ 1.5kHz", "SOUR1:FREQ:FIX?", "1.5E+03"),
        ("FREQ 1 uHz", "FREQ?", "1.0E-06"),
        ("FREQ 2mhz", "FREQ?", "2.0E+06"),
        ("Sour2:Volt:Lev .5", "SOURCE2:VOLT:AMPL?", "5.0E-01"),
        ("SOUR1:VOLT:LEV:IMM:AMPL 2.5VPP", "VOLT?", "2.5E+00"),
        ("VOLT 50 mVpp", "VOLT?", "5.0E-02"),
        ("VOLT:OFFS -100mV", "VOLT:OFFS?", "-1.0E-01"),
        ("BURS:STAT ON", "BURS:STAT?", "1"),
        ("BURS:NCYC 7", "BURS:NCYC?", "7.0E+00"),
        ("BURS:NCYC INF", "BURS:NCYC?", "9.9E+37"),
        ("BURS:MODE GAT", "BURS:MODE?", "GAT"),
        ("FREQ:MODE CW", "FREQ:MODE?", "CW"),
        ("FREQ:CONC ON", "FREQ:CONC?", "1"),
        ("AM:STAT OFF", "AM:STAT?", "0"),
        ("DATA:DEF EMEM,512", "DATA:POIN? EMEM", "512"),
        ("DATA:COPY USER5,EMEM", "DATA:CAT?", '"EMEM","USER5"'),
        ("*WAI", "*OPC?", "1"),
    ],
)
def test_a_setting_is_read_back_as_set_and_leaves_no_error(command, query, answer):
    device = generator()
    assert device.execute(command.encode()).data == b""
    assert ask(device, query) == answer
    assert errors(device) == []


@pytest.mark.parametrize(
    ("command", "code"),
    [
        ("VOLT 20.1", -222),
        ("VOLT 0.5mV", -222),
        ("FREQ 26MHz", -222),
        ("FUNC RAMP;:FREQ 2MHz", -222),
        ("BURS ON;:FREQ 1uHz", -222),
        ("OUTP:IMP 0.1", -222),
        ("BURS:NCYC 60000", -222),
        ("PHAS:ADJ -1DEG", -222),
        ("VOLT 9;VOLT:OFFS 1", -221),
        ("FREQ:MODE SWE", -241),
        ("FUNC PRN;:BURS ON", -221),
        ("AM:STAT ON", -241),
        ("AM:DEPT 30", -113),
        ("FUNC USER7", -224),
        ("FUNC USER256", -224),
        ("FUNC NOTASHAPE", -224),
        ("FREQ", -109),
        ("FREQ 1,2", -108),
        ("FREQ 1V", -131),
        ("FREQ much", -104),
        ("FREQ 1e999", -123),
        ("VOLTA 1", -113),
        ("SOURC1:VOLT 1", -113),
        ("DATA:DATA EMEM,abcd", -161),
        ("FREQ MAX", -104),
        ("VOLT:HIGH 1", -113),
        ("VOLT:UNIT VRMS", -113),
        ("TRIG:SOUR EXT", -113),
        ("DATA:CAT", -113),
        ("SOUR3:FREQ 1", -114),
        ("SOUR2:BURS ON", -114),
        ("DATA:DEF EMEM,1", -222),
        ("DATA:DEF EMEM,8193", -222),
        ("DATA:DATA EMEM,#13abc", -161),
        ("DATA:DATA EMEM,#14\x00\x01~~", -222),
    ],
)
def test_a_refused_command_queues_its_error_number_and_changes_nothing(command, code):
    device = generator()
    *before, last = command.split(";")
    device.execute(";".join(before).encode())
    assert errors(device) == []
    settings = (device.settings(1), device.settings(2), device.memory.names)
    device.execute((last if last.startswith((":", "*")) else ":" + last).encode())
    assert errors(device) == [code]
    assert (device.settings(1), device.settings(2), device.memory.names) == settings


def test_the_peak_limit_is_10_v_into_an_open_circuit_and_5_v_into_50_ohm():
    device = generator(b"VOLT 8;VOLT:OFFS 1")
    assert errors(device) == []
    device.execute(b":VOLT:OFFS 1.001")
    assert errors(device) == [-221]
    device.execute(b":OUTP:IMP INF;:VOLT:OFFS 2;:VOLT 16")
    assert errors(device) == []
    device.execute(b":VOLT 16.001")
    assert errors(device) == [-221]


def test_declaring_another_load_changes_the_displayed_voltage_but_not_the_output():
    device = generator(b"VOLT 2;:OUTP:IMP INF")
    assert ask(device, "VOLT?") == "4.0E+00"
    device.execute(b"OUTP:IMP 150")
    assert float(ask(device, "VOLT?")) == pytest.approx(3.0)


def test_a_phase_is_given_in_radians_and_stored_in_whole_degrees():
    device = generator(b"PHAS:ADJ 31.9DEG")
    assert float(ask(device, "PHAS?")) == pytest.approx(math.radians(31))
    device.execute(f"PHAS:ADJ {math.radians(31):.12g}".encode())
    assert float(ask(device, "PHAS?")) == pytest.approx(math.radians(31))


def test_a_shape_with_a_lower_frequency_limit_reduces_the_frequency():
    device = generator(b"FREQ 20MHz;:FUNC SQU")
    assert ask(device, "FREQ?") == "1.25E+07"


def test_channels_with_locked_frequencies_share_one_frequency():
    device = generator(b"SOUR1:FREQ 100;:SOUR1:FREQ:CONC ON")
    assert ask(device, "SOUR2:FREQ?") == "1.0E+02"
    device.execute(b"SOUR2:FREQ 333")
    assert ask(device, "SOUR1:FREQ?") == "3.33E+02"


def test_several_queries_in_one_message_are_answered_in_one_line():
    assert ask(generator(), "*OPC?;SOUR1:FREQ?;VOLT?") == "1;1.0E+06;1.0E+00"


def test_a_reset_selects_a_sine_of_1_mhz_and_1_v_with_the_output_off():
    device = generator(b"OUTP ON;:FUNC RAMP;:FREQ 5;:VOLT 3;:VOLT:OFFS 1;:OUTP2 ON", b"*RST")
    assert ask(device, "OUTP?;:OUTP2?;:FUNC?;:FREQ?;:VOLT?;:VOLT:OFFS?") == "0;0;SIN;1.0E+06;1.0E+00;0.0E+00"


def test_the_event_register_distinguishes_kinds_of_error_and_is_cleared_when_it_is_read():
    device = generator()
    assert ask(device, "*ESR?") == "128"  # power on
    device.execute(b"NONSENSE")
    assert ask(device, "*ESR?") == "32"
    device.execute(b"FREQ 99MHz;*OPC")
    assert ask(device, "*ESR?;*ESR?") == "17;0"


def test_the_error_queue_reports_an_overflow_at_its_end_and_is_cleared_by_cls():
    device = generator(*[b"NONSENSE"] * 30)
    assert errors(device) == [-113] * 19 + [-350]
    device.execute(b"NONSENSE;*CLS")
    assert errors(device) == []


class TestQuirks:
    def test_the_identity_is_empty_at_the_first_query_after_a_clear_and_correct_at_the_second(self):
        device = generator(first_identity_after_clear_is_empty=True)
        identity = ask(device, "*IDN?")
        assert identity.split(",")[:3] == ["TEKTRONIX", "AFG1022", "C010101"]
        device.execute(b"*CLS")
        assert [ask(device, "*IDN?"), ask(device, "*IDN?")] == ["", identity]

    def test_high_impedance_is_answered_with_an_ohm_sign_in_gbk(self):
        device = generator(b"OUTP:IMP INF", high_impedance_has_ohm_sign=True)
        reply = device.execute(b"OUTP:IMP?").data
        assert reply == b"9.9E+37\xa6\xb8\n"
        assert reply.decode("gbk").strip() == "9.9E+37Ω"

    def test_an_unknown_query_is_answered_by_an_empty_line_and_queues_error_minus_102(self):
        device = generator(unknown_is_syntax_error=True)
        assert device.execute(b"VOLT:LIM?").data == b"\n"
        assert errors(device) == [-102]

    def test_an_unknown_query_is_not_answered_without_the_empty_line_quirk(self):
        device = generator()
        assert device.execute(b"VOLT:LIM?").data == b""
        assert errors(device) == [-113]

    def test_a_value_out_of_range_is_silently_replaced_by_the_default(self):
        device = generator(b"VOLT 0.2;VOLT 11;:FREQ 30MHz", out_of_range_becomes_default=True)
        assert ask(device, "VOLT?;:FREQ?") == "1.0E+00;1.0E+06"
        assert errors(device) == []

    def test_with_the_panel_quirk_the_load_can_be_set_only_at_the_panel(self):
        device = generator(b"OUTP:IMP INF", panel_load_ohm=50.0)
        assert errors(device) == [-113]
        device.execute(b"OUTP ON")
        assert ask(device, "OUTP?") == "1"


def test_a_corrupted_reply_is_followed_by_a_correct_reply():
    device = generator()
    sound = device.execute(b"*IDN?").data
    device.corrupt_next_reply()
    spoilt = device.execute(b"*IDN?").data
    assert (len(spoilt), spoilt[-1:]) == (len(sound), b"\n")
    assert not spoilt.isascii()
    assert device.execute(b"*IDN?").data == sound


def test_setting_the_duty_cycle_succeeds_but_queues_error_minus_102():
    device = generator(b"PULS:DCYC 20")
    assert ask(device, "PULS:DCYC?") == "2.0E+01"
    assert errors(device) == [-102]


@pytest.mark.parametrize("mode", MODULATIONS)
def test_a_modulation_left_on_at_the_panel_is_reported_and_switched_off(mode):
    device = generator()
    device.configure(1, replace(device.settings(1), mode=mode))
    assert ask(device, f"{mode.value}:STAT?") == "1"
    device.execute(f"{mode.value}:STAT OFF".encode())
    assert ask(device, f"{mode.value}:STAT?") == "0"
    assert errors(device) == []
