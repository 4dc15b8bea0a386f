"""Recognizers of the literature, each a kind that `hmcs train --recognizer` knows by its name."""
