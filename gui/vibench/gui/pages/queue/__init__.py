"""The Queue page: a campaign as a table, its sweeps, and the state of each recording.

An edit that would make the campaign invalid is refused. Another process computes duration and size.
"""
