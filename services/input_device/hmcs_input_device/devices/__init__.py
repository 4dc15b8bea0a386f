"""Devices a hand moves: read into one form, then mapped to the motion of a hand by one mapping."""
