"""Copies of frozen models in which fields of their parts differ."""

from pydantic import BaseModel


def changed(model, **fields):
    """Copy a model with other fields; a dictionary changes the fields of a part that is a model."""
    update = {}
    for name, value in fields.items():
        part = getattr(model, name)
        is_part = isinstance(part, BaseModel) and isinstance(value, dict)
        update[name] = part.model_copy(update=value) if is_part else value
    return model.model_copy(update=update)
