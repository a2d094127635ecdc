"""pyqtgraph with its traps closed: axes with units, 1-2-5 ticks, envelopes, colours that all can tell."""
