from ._case import (
    AS_CHOSEN as AS_CHOSEN,
    OPTIONS as OPTIONS,
    Case as Case,
    case_with as case_with,
)
from ._catalogue import (
    SECTIONS as SECTIONS,
)
from ._damping_score import (
    damping_score_figure as damping_score_figure,
)
from ._document import (
    Reproduction as Reproduction,
    reproduction_document as reproduction_document,
    reproduction_page as reproduction_page,
    verdict_text as verdict_text,
)
from ._evidence import (
    Evidence as Evidence,
    levels_asked as levels_asked,
)
from ._reproduce import (
    reproduction as reproduction,
)
