"""Small widgets and texts that every part of the window uses.

The package contains colour themes and style sheets, buttons, tables, hints in empty areas, notices, box
layouts, page names, and times on labels. It imports neither pages nor engine.
"""
