"""Gathers the evidence of all classifiers and publishes the belief over task states.

Open `service` first; `gathering` waits for the evidence of a step until its deadline.
"""
