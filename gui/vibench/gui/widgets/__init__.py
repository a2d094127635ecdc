"""Small widgets and words that every part of the window uses.

Colour themes and style sheets, buttons, tables to read, hints in empty areas, notices to the
person, boxes of layouts, page names, and times as they are written on labels. It knows neither pages nor
engine.
"""
