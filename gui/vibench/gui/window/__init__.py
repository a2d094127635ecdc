"""The window itself: frame, banner with STOP, messages, list of pages, menus, status line.

It creates the pages of the page catalogue, calls the engine link at every tick, and shows the state of the
rig above every page. Esc and Pause abort a run from any page. A monitor measures how long the event loop
is blocked. `make_screenshots` saves pictures of every page during a measurement.
"""
