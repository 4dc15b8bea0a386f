"""The fixture controller: turns the operator's velocity into the robot's reference velocity.

Open `service` first: it feeds messages to `hmcs.fixtures.controller` and publishes the command.
`models` holds the loaded models, `speakers` knows which processes run a recognizer.
"""
