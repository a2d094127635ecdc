"""The Queue page: a campaign as a table, its sweeps, and how each point stands.

Every edit gives a complete, valid campaign or is refused. Duration and size are computed in another process.
"""
