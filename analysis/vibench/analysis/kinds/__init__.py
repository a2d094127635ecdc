"""Registry of analyses: one entry per kind of excitation, looked up by ``excitation.kind``.

An entry defines how a recording of the kind is analysed, how its simulation is overlaid, which curves a
comparison shows and what the JSON document contains. Kinds of one family share most of their entry. Drawings
and texts of results are in `report`, because `report` loads matplotlib.
"""
