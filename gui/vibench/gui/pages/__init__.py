"""Pages of the window: one module or package per page, independent of one another.

This package itself imports no page, so that a worker process that runs a function of one page does not load
the other pages. The window's page catalogue lists the pages in the order of work.
"""
