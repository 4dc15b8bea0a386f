"""The operator's page: robot, belief and fixture in a browser, and a handle to move the robot.

Open `service` first. `seeing` gathers what arrives on the bus, `drawing` makes the scene of it,
`telling` the plots and texts, `operating` the handle, `teaching` records and trains, `serving` lets
viewers in.
"""
