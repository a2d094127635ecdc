"""Copy frozen models with changed fields, also in nested models."""

from pydantic import BaseModel


def changed(model, **fields):
    """Copy a model with changed fields; a dictionary changes fields of a nested model."""
    update = {}
    for name, value in fields.items():
        part = getattr(model, name)
        is_part = isinstance(part, BaseModel) and isinstance(value, dict)
        update[name] = part.model_copy(update=value) if is_part else value
    return model.model_copy(update=update)
