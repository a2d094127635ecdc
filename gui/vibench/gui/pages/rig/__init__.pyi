from ._rig_page import (
    RigPage as RigPage,
)
