"""Protocols of a bench's instruments, their values, and the plug-ins that provide them.

An instrument is a class that implements one of the protocols here, and an entry point of an installed package
that names it: ``vibench.generators``, ``vibench.digitizers``, ``vibench.outputs``, ``vibench.controllers``,
``vibench.sensors``. A hardware configuration uses that name. Our own instruments are rows of the same kind.
docs/instruments.md explains how to write one; `vibench.acquisition.contract` tests it.

>>> from vibench.acquisition.instruments import PlugInKind, plug_in
>>> plug_in(PlugInKind.GENERATOR, "afg1022x").name
'AFG1022'
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
