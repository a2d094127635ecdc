"""Forms made from the pydantic models of a plan: one field for every value.

Labels, units, limits and explanations come from the model's fields; the model itself judges
what was typed. An editor for each type of value; quantities are typed with units ("45 µm").
It knows no particular model.
"""
