"""HMCS: intent recognition and adaptive virtual fixtures for human-machine collaboration."""

__version__ = "0.1.0"
