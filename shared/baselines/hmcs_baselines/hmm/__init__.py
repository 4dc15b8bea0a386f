"""Hidden Markov models beyond what the default recognizer needs; see TUTORIAL.md."""
