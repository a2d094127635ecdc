"""Simulations asked for by a person: what is asked, how the answer grows, and what it costs."""
