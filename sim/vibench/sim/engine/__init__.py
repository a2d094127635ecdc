"""The engine: flight in closed form, contacts in controlled steps, and what is observed on the way."""
