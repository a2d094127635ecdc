from ._boxes import (
    Scrolled as Scrolled,
    boxed as boxed,
    column as column,
    filled as filled,
    row as row,
    title_of as title_of,
)
from ._clock import (
    clock as clock,
    moment_text as moment_text,
)
from ._elided_label import (
    ElidedLabel as ElidedLabel,
    plain_tip as plain_tip,
)
from ._hint import (
    paint_hint as paint_hint,
)
from ._new_path import (
    new_path as new_path,
)
from ._notice import (
    Notice as Notice,
    NoticeKind as NoticeKind,
    notice_of as notice_of,
)
from ._outcome_text import (
    outcome_text as outcome_text,
)
from ._page_names import (
    COMPARE as COMPARE,
    FILES as FILES,
    MAPS as MAPS,
    QUEUE as QUEUE,
    RIG as RIG,
    RUN as RUN,
    SIMULATE as SIMULATE,
    TEST as TEST,
)
from ._push_button import (
    push_button as push_button,
)
from ._read_table import (
    ReadTable as ReadTable,
)
from ._table_copy import (
    offer_copies as offer_copies,
)
from ._theme import (
    DARK as DARK,
    LIGHT as LIGHT,
    THEMES as THEMES,
    Colour as Colour,
    Theme as Theme,
    Tone as Tone,
    palette as palette,
    style_sheet as style_sheet,
)
from ._timed_bar import (
    ProgressBar as ProgressBar,
    TimedBar as TimedBar,
)
from ._units import (
    AUTOMATIC as AUTOMATIC,
    CHOICES as CHOICES,
    POWERS as POWERS,
    STANDARD_GRAVITY as STANDARD_GRAVITY,
    UNITS as UNITS,
    SentenceLabel as SentenceLabel,
    ShownUnit as ShownUnit,
    fitted_unit as fitted_unit,
    plain_unit as plain_unit,
)
