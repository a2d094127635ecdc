"""What the pages of the window share.

`Page` is their base class; `AppContext` hands each of them the bridge, settings, background work and
signals to the window. `Selection` holds rig, test and campaign as they are being made, none of them
sent yet; `UserActions` carries out what keys, menus and buttons ask for.
Pages know each other by name only.
"""
