"""Devices a hand moves: each told alike, and made the motion of a hand by one mapping."""
