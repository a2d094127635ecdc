from ._parameters import (
    PACE as PACE,
    RATE as RATE,
    RATE_SCALE as RATE_SCALE,
    ROOT as ROOT,
    ROOT_SCALE as ROOT_SCALE,
    SIDE as SIDE,
    STATE_SIZE as STATE_SIZE,
    STEP as STEP,
    Parameters as Parameters,
    PowerTerms as PowerTerms,
    parameters as parameters,
    power_terms as power_terms,
)
