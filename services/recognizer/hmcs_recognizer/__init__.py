"""Any registered recognizer in one process: steps in, beliefs out."""
