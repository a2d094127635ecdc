"""Protocols of a bench's instruments, their data types, and the plug-ins that provide them.

An instrument is a class that implements one of these protocols. Its package registers it as an entry point of
the group ``vibench.generators``, ``vibench.digitizers``, ``vibench.outputs``, ``vibench.controllers`` or
``vibench.sensors``. A hardware configuration contains the entry point's name.
docs/instruments.md explains how to write an instrument; `vibench.acquisition.contract` tests an instrument.

>>> from vibench.acquisition.instruments import PlugInKind, plug_in
>>> plug_in(PlugInKind.GENERATOR, "afg1022x").name
'AFG1022'
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
