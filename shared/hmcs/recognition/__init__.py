"""Recognition of intent, in process: arrays in, arrays out; no bus, no clock.

A *gesteme* is a motion primitive: one meaningful piece of motion. A recognizer estimates which
state of a task is being performed, and with which gesteme. Open `recognizer` first: the interface
of every recognizer. `learning` trains a model, `model_file` keeps it, `registry` lists the kinds.
`segment_filter` is the default recognizer, `hmm` has hidden Markov models, `discovery` finds states
in unlabeled demonstrations.
"""
