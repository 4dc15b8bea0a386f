"""Recognition of intent: arrays in, arrays out; no wire, no clock, no process."""
