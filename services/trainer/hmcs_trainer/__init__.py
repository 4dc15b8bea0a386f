"""Learns a model from demonstrations of a task."""
