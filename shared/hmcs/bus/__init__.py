"""The message bus: what processes exchange, by which keys and with which quality of service.

Nothing here imports the science. Open `messages` first: every message with its fields and units.
`keys` names where each is published, `session` is a process' connection to the bus, `service` its
life cycle, `verbs` the questions that processes answer.
"""
