"""Motion: steps after the dead zone, paths, demonstrations, simulated operators.

Positions are in m, arrays of shape (3,) or (T, 3). Nothing here knows the wire.
"""
