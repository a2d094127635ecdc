"""The waveform memory of the simulated Keysight 33500B is limited."""

import numpy as np

from vibench.virtual_rig.usb.usbtmc import UsbTmcInstrument
from vibench_more_drivers.virtual_keysight_33500b import Keysight33500B


def reply_to(generator, message):
    return generator.execute(message).data


def test_new_waveforms_are_refused_when_the_memory_is_full():
    generator = Keysight33500B(lambda: 0.0)
    codes = np.zeros(400_000, dtype=">i2").tobytes()
    told = []
    for number in range(4):
        reply_to(generator, b"DATA:ARB:DAC W%d,#6%d" % (number, len(codes)) + codes)
        told.append(int(reply_to(generator, b"SYST:ERR?").split(b",")[0]))
    assert told == [0, 0, -225, -225]
    reply_to(generator, b"DATA:VOL:CLE")
    reply_to(generator, b"DATA:ARB:DAC W9,#6%d" % len(codes) + codes)
    assert reply_to(generator, b"DATA:ATTR:POIN? W9") == b"4.0E+05\n"


def test_the_longest_supported_waveform_arrives_through_usb():
    generator = Keysight33500B(lambda: 0.0)
    instrument = UsbTmcInstrument(generator)
    codes = np.zeros(1_048_576, dtype=">i2").tobytes()
    message = b"DATA:ARB:DAC LONGEST,#7%d" % len(codes) + codes
    header = bytes([1, 1, 254, 0]) + len(message).to_bytes(4, "little") + bytes([1, 0, 0, 0])
    instrument.bulk_out(header + message + bytes(-len(message) % 4))
    assert float(reply_to(generator, b"DATA:ATTR:POIN? LONGEST")) == 1_048_576
