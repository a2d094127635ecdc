"""Small widgets and words that every part of the window uses.

Colour themes and style sheets, buttons, tables, hints in empty areas, notices, box layouts, page names, and
times on labels. Pages and engine are unknown here.
"""
