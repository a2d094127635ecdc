"""Forms made from the pydantic models of a plan: one field for every value.

Labels, units, limits and explanations come from the model's fields; the model itself validates the input.
Each type of value has an editor; quantities are typed with units ("45 µm"). The forms
depend on no particular model.
"""
