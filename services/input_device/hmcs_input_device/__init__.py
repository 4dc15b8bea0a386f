"""Input device: publishes the operator's motion, and its steps after the dead zone."""
