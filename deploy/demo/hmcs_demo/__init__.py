"""The demo: the whole stack on held-out human motion, measured, with a report to look at."""
