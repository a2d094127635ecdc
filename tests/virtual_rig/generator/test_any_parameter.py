"""Every parameter of every command of a simulated generator is obeyed or queued as an error."""

import numpy as np
import pytest

from vibench.acquisition.instruments import PlugInKind, plug_in, plug_in_names

PARAMETERS = (
    *(
        b"",
        b"abc",
        b"1e400",
        b"-1e400",
        b"nan",
        b"inf",
        b"MAX",
        b"MIN",
        b"DEF",
        b"ON",
        b"2",
        b"-1",
        b"1 Hz",
        b"1e3 kHz",
    ),
    *(b"#", b"#0", b"#9", b"#15", b"#1", b"#215abc", b"'x", b'"x"', b"\xff\xfe", b"9" * 400, b"1e999999999"),
    *(b"1,2", b"1,abc,3", b"W,1,2,3,4,5,6,7,1e300", b"W,1.5,2,3,4,5,6,7,8", b"W,#216abcdefghijklmnop"),
    *(b"USER0", b"EMEM", b"EMEM,5", b"EMEM,#14abcd", b"EMEM,99999999", b"USER1,EMEM"),
)


VENDORS = [each for each in plug_in_names(PlugInKind.VIRTUAL_INSTRUMENT) if each.startswith("0x")]


@pytest.mark.parametrize("vendor", VENDORS)
def test_every_command_handles_any_parameter_without_failing(vendor):
    generator = plug_in(PlugInKind.VIRTUAL_INSTRUMENT, vendor)(lambda: 0.0)
    for command in generator.commands:
        header = command.header.translate(str.maketrans("#", "1", "[]")).encode()
        for mark in (b"", b"?"):
            for parameter in PARAMETERS:
                generator.execute(header + mark + b" " + parameter)
    assert np.all(np.isfinite(generator.render(0.0, 1e-5, 100)))
    generator.execute(b"*CLS")
    assert generator.execute(b"SYST:ERR?").data.startswith(b"0,")
