"""The memory of one run, slot by slot: the specimen's numbers, the state vector, the record.

`_parameters` turns a `Specimen` into plain numbers and numbers the places of the state vector that every
kernel advances in place; `_record` is what a run fills on its way (samples, impacts, counts) and its codes
of ending. Filling a slot never changes a step of the motion.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
