"""The Queue page: a campaign as a table, its sweeps, and the state of each point.

An edit is refused unless it gives a complete, valid campaign. Another process computes duration and size.
"""
