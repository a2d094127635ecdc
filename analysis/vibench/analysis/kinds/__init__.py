"""What analysis does with each kind of excitation: one row a kind, looked up by ``excitation.kind``.

A row defines how a recording of the kind is analysed, how its simulation is overlaid on it, which curves a
comparison shows and what its JSON document contains. Kinds of one family share most of their row. How
results are drawn and worded is kept apart, in `report`, because that loads matplotlib.
"""
