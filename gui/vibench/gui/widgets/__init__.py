"""Small widgets and texts that every part of the window uses.

It contains colour themes and style sheets, buttons, tables, hints in empty areas, notices, box layouts, page
names, and times on labels. The package imports neither pages nor engine.
"""
