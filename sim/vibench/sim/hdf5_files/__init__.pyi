from ._door import (
    UnsafeHdf5 as UnsafeHdf5,
    external_data_allowed as external_data_allowed,
    open_hdf5 as open_hdf5,
    walk as walk,
)
