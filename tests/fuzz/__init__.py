"""Hostile messages and questions by the thousand: nothing anybody sends harms a process."""
