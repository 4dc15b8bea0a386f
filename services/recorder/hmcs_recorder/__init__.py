"""Recordings: written while the stack runs, read, exported and replayed afterwards."""
