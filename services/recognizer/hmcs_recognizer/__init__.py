"""Any registered recognizer in one process: steps in, beliefs out.

Open `service` first; `hosted` is one model with its recognizer, of which it runs any number.
"""
