"""The pages of the window, one package a page, independent of each other.

This package imports none of them, because a worker process that runs a function of one page must not load
the other pages. The window's page catalogue lists the pages in the order of work.
"""
