"""Finds gestemes and task states in demonstrations without labels.

A *gesteme* is a motion primitive: one meaningful piece of motion. Open `unlabeled` first: it goes
from demonstrations to labeled ones. `order_cuts` and `stops` cut the motions, `consensus` averages
performances of the same motion, `task_states` makes the states and their order.
"""
