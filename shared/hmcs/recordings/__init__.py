"""Recordings of a cell: MCAP files, written, read, labeled, exported and replayed.

Open `reading` first: what a recording holds. `writing` makes one, `label_files` keeps its labels,
`demonstrations` makes training data of it, `replaying` runs another model on it, `exporting` writes
tables.
"""
