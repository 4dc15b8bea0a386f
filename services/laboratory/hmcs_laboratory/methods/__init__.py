"""The methods that studies compare, ours and the libraries people use, each behind one protocol.

`registered` holds the lists: methods that classify a whole gesteme, and methods that follow a task
step by step.
"""
