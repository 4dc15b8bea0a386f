"""Scores gestemes for every segment start still possible: one of several classifiers in parallel.

A *gesteme* is a motion primitive: one meaningful piece of motion. Open `service` first; `shares`
says which gestemes this instance scores.
"""
