from ._crate import CrateFacts as CrateFacts, pack_folder as pack_folder
from ._excerpt import (
    Excerpt as Excerpt,
    excerpt as excerpt,
    sep005 as sep005,
    xarray_dataset as xarray_dataset,
)
from ._export import (
    Format as Format,
    Results as Results,
    export_functions as export_functions,
    export_samples as export_samples,
    export_scan as export_scan,
    new_file as new_file,
)
from ._import_recording import import_recording as import_recording
from ._mapping import ImportMapping as ImportMapping
from ._source import open_source as open_source
from ._source_channel import SourceChannel as SourceChannel
from ._uff import (
    FunctionAxis as FunctionAxis,
    FunctionType as FunctionType,
    UniversalFunction as UniversalFunction,
)
