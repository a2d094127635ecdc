from ._backbone import (
    backbone_figure as backbone_figure,
)
from ._bench_levels import (
    bench_levels_figure as bench_levels_figure,
)
from ._branches import (
    branches_figure as branches_figure,
    draw_line as draw_line,
)
from ._chain import (
    chain_figure as chain_figure,
)
from ._comparison import (
    comparison_figure as comparison_figure,
)
from ._contact_forces import (
    contact_forces_figure as contact_forces_figure,
)
from ._distortion import (
    distortion_figure as distortion_figure,
)
from ._drawn import (
    DrawnFigure as DrawnFigure,
)
from ._dwells import (
    dwells_figure as dwells_figure,
)
from ._ensemble_band import (
    agreement_text as agreement_text,
)
from ._excitation import (
    excitation_figure as excitation_figure,
)
from ._exponent_spectrum import (
    exponent_spectrum_figure as exponent_spectrum_figure,
)
from ._held_branch import (
    held_branch_figure as held_branch_figure,
)
from ._hidden_motion import (
    hidden_impacts_figure as hidden_impacts_figure,
    hidden_motion_figure as hidden_motion_figure,
)
from ._hysteresis import (
    hysteresis_figure as hysteresis_figure,
)
from ._image_kind import (
    ImageKind as ImageKind,
)
from ._map_quantities import (
    SHOWN as SHOWN,
)
from ._maps import (
    map_figure as map_figure,
)
from ._portraits import (
    portraits_figure as portraits_figure,
    verdict_text as verdict_text,
)
from ._stepped_sine import (
    STEPPED_FREQUENCIES as STEPPED_FREQUENCIES,
    STEPPED_LEVELS as STEPPED_LEVELS,
    TRACKED_RESONANCE as TRACKED_RESONANCE,
    SteppedLook as SteppedLook,
    stepped_level_caption as stepped_level_caption,
    stepped_sine_figure as stepped_sine_figure,
)
from ._style import (
    COLLIDING as COLLIDING,
    LEVEL_STYLES as LEVEL_STYLES,
    LEVELS as LEVELS,
    LINEAR as LINEAR,
    MEASURED as MEASURED,
    SIMULATED as SIMULATED,
    TERMINAL as TERMINAL,
    frequency_axis as frequency_axis,
    legend_above as legend_above,
    magnitude_axis as magnitude_axis,
    new_figure as new_figure,
    styled as styled,
)
from ._sweep import (
    regions_text as regions_text,
    sweep_figure as sweep_figure,
)
from ._sweep_orders import (
    sweep_orders_figure as sweep_orders_figure,
)
from ._tradeoff import (
    tradeoff_figure as tradeoff_figure,
)
from ._transmission import (
    transmission_figure as transmission_figure,
)
from ._transmission_levels import (
    transmission_levels_figure as transmission_levels_figure,
)
