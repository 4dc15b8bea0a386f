"""The `hmcs` commands: a file for each family, with their options, and what each one calls."""
