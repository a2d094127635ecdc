"""Analysis of each kind of excitation: a table with one row per kind, looked up by ``excitation.kind``.

A row defines how a recording of the kind is analysed, how its simulation is overlaid, which curves a
comparison shows and what the JSON document contains. Kinds of one family share most of their row. Drawings
and texts of results are in `report`, because `report` loads matplotlib.
"""
