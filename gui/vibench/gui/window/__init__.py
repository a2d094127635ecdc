"""The window itself: frame, banner with STOP, messages, list of pages, menus, status line.

It makes the pages from the page catalogue, asks the engine link at every tick, and shows the
state of the rig on every page. Esc and Pause abort from anywhere. The lateness of the event loop
is measured all the time. `make_screenshots` pictures every page during a measurement.
"""
