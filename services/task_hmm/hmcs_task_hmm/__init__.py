"""Gathers evidence from all classifiers and publishes the belief over task states."""
