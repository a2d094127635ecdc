"""The Rig page: which bench, is it there, is it well."""
