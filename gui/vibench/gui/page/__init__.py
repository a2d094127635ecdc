"""Common parts of the window's pages.

`Page` is their base class. `AppContext` gives each page the bridge to the engine, settings, background work
and signals to the window. `Selection` holds rig, test and campaign while they are edited. `UserActions`
carries out the commands of keys, menus and buttons. Pages refer to other pages by name only.
"""
