"""Recordings of a cell: MCAP files, written, read, labeled, exported and replayed."""
