"""The robot: a simulated arm that follows velocity commands within its limits.

Open `service` first, then `control_process`: control runs in a process of its own. `limits` bounds
speeds, accelerations and joints, `fence` keeps the tool out of forbidden regions,
`hmcs.supervision` decides when the arm stops, `driver` is what another arm has to implement,
`engine` what another physics engine has to.
"""
