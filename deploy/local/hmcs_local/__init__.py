"""The `hmcs` command: the stack of compose.yaml as processes on this machine."""
