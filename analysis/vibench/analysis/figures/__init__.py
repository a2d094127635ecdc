"""The figures of a report: one a file, drawn without a display, each with its caption and its numbers."""
