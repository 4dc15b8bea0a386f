"""The recorder: writes what is published into MCAP files while the stack runs.

Open `service` first; `labeling` writes the labels of a recording. The files themselves are the
work of `hmcs.recordings`.
"""
