"""The Queue page: a campaign as a table, its sweeps, and how each point stands.

Every change gives a whole, valid campaign or is refused; duration and size are worked out in
another process. `_row_words` is loaded there.
"""
