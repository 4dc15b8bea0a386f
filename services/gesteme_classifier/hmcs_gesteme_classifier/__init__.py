"""Scores gestemes for every living segment start: one of several classifiers in parallel."""
