"""The layered segment filter, the default recognizer: restart is inferred, not assumed."""
