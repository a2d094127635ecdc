"""The Queue page: a campaign as a table, its sweeps, and the state of each point.

Every edit gives a complete, valid campaign or is refused. Duration and size are computed in another process.
"""
