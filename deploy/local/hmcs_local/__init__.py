"""The `hmcs` command: the stack of compose.yaml as processes on this machine.

Open `command` first: every subcommand. `stack` and `launcher` start and watch the processes,
`deploying` and `swap` replace a model or a recognizer while they run.
"""
