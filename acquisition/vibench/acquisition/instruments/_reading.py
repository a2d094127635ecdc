"""What is asked of every converter's block, whoever wrote its driver."""

from ..errors import InstrumentError
from ._protocols import Digitizer
from ._values import Block


def read_block(digitizer: Digitizer, samples: int) -> Block:
    """Read a block that holds samples: whoever waits for more of them would wait for ever.

    Parameters
    ----------
    digitizer
        Samples are being converted.
    samples
        How many of every channel.

    Raises
    ------
    InstrumentError
        When the block holds none, or what `Digitizer.read` raises.

    """
    block = digitizer.read(samples)
    if block.volts.ndim != 2 or block.volts.shape[1] == 0:
        raise InstrumentError(
            f"the converter handed over a block of shape {block.volts.shape} where {samples} samples of "
            "every channel were asked for; its driver must wait until they are there, or raise InstrumentLost"
        )
    return block
