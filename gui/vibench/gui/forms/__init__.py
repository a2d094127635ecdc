"""Forms made from plan models: a field for every value, with its unit, its limits and its complaint."""
