"""What is asked of every converter's block, whoever wrote its driver."""

import numpy as np

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
        When the block holds none, of other channels, or no finite volts; or what `Digitizer.read` raises.

    """
    block = digitizer.read(samples)
    rows = len(digitizer.roles)
    if block.volts.ndim != 2 or block.volts.shape[0] != rows or block.volts.shape[1] == 0:
        raise InstrumentError(
            f"the converter handed over a block of shape {block.volts.shape} where {samples} samples of "
            f"{rows} channels were asked for; its driver must wait until they are there, or raise "
            "InstrumentLost"
        )
    if not np.isfinite(block.volts).all():
        raise InstrumentError(
            f"the converter handed over samples that are no numbers, from sample {block.first_sample} on; "
            "its driver must hand over volts, or raise DataLost"
        )
    return block
