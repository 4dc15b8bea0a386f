"""Input device: publishes the operator's motion, and its steps after the dead zone.

Open `service` first. `sources` is the interface of a device, `devices` has those of a hand,
`playback` and `simulated` play or simulate an operator, `press_gate` decides when a press of the
dead-man switch counts.
"""
