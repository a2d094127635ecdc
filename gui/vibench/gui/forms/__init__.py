"""Forms made from the pydantic models of a plan: one field per value.

Labels, units, limits and explanations come from the model's fields; the model itself validates the input.
Each type of value has an editor; quantities are typed with units ("45 µm"). Any model can be used; no form is
written for a particular model.
"""
