from ._beside import (
    Beside as Beside,
)
from ._chosen import (
    ChosenFrom as ChosenFrom,
    chosen as chosen,
)
from ._closed_on_leaving import (
    ClosedOnLeaving as ClosedOnLeaving,
)
from ._documentation import (
    built_site as built_site,
    documentation_page as documentation_page,
)
from ._extras import (
    naming_its_extra as naming_its_extra,
    need_extra as need_extra,
    need_space as need_space,
)
from ._follow_parent import (
    follow_parent as follow_parent,
)
from ._log import (
    LOG as LOG,
)
from ._printable import (
    printable as printable,
    shortened as shortened,
)
from ._schema import (
    json_schema as json_schema,
    schema_line as schema_line,
)
from ._shipped import (
    all_shipped as all_shipped,
    named as named,
    shipped as shipped,
    shipped_folder as shipped_folder,
)
from ._toml_file import (
    FrozenModel as FrozenModel,
    complaints as complaints,
    from_toml as from_toml,
    load_toml as load_toml,
    save_toml as save_toml,
    toml_text as toml_text,
    validated as validated,
)
