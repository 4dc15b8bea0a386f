"""Learns a model from demonstrations of a task.

Open `training` first: from a task and demonstrations to a model. `validation` and
`plausibility` check the demonstrations, `judging` measures the model, `advice` and `report` say how
to improve it, `service` trains for the operator's page.
"""
