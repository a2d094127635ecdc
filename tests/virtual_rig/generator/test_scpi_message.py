from hypothesis import given, strategies as st

from vibench.virtual_rig.generator.scpi_message import as_block, block, units


def test_a_message_chain_is_split_into_one_unit_per_command():
    found = units(b"SOUR1:FREQ 1kHz; VOLT?;;*OPC?\n")
    assert [(unit.header, unit.asks, unit.parameters) for unit in found] == [
        ("SOUR1:FREQ", False, (b"1kHz",)),
        ("VOLT", True, ()),
        ("*OPC", True, ()),
    ]


def test_only_the_first_unit_of_a_line_starts_at_the_scpi_root():
    found = units(b"FREQ 1;VOLT 2\nPHAS 3;DEL 4\n")
    assert [unit.starts_line for unit in found] == [True, False, True, False]


def test_separators_of_commands_inside_quotes_are_ignored():
    (unit,) = units(b"TEXT \"a;b,c\n\",'d,e'\n")
    assert unit.parameters == (b'"a;b,c\n"', b"'d,e'")


@given(st.binary(max_size=300))
def test_a_binary_block_between_other_units_keeps_its_bytes(data):
    message = b"FREQ 1;:DATA EMEM," + as_block(data) + b";VOLT?\n"
    _, upload, query = units(message)
    assert block(upload.parameters[1]) == data
    assert query.header == "VOLT"
