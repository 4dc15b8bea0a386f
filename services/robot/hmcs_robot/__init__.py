"""The robot: a simulated arm that follows velocity commands within its limits."""
