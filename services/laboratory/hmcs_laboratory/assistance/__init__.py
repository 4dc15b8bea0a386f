"""What assistance is worth: simulated operators at a fixture, in process, faster than real time."""
