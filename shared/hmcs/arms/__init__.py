"""Arms of joints: their description, where their tool is, and how they follow a velocity of it.

`urdf` reads a description, `chain` is the arm between two of its links, `control` makes joint
velocities of the tool's velocity within `limits`, and `fence` says where the tool must not go.
"""
