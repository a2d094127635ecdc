"""Pages of the window: one package for each page, independent of the others.

This package imports none of them, because a worker process that runs a function of one page must not load
the other pages. The window's page catalogue lists the pages in the order of work.
"""
