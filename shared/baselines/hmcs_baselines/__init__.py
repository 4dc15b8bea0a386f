"""Recognizers of the literature, each a kind that `hmcs train --recognizer` knows by its name.

A *gesteme* is a motion primitive: one meaningful piece of motion. Open `layered_hmm` first: the
layered HMM of the thesis' chapter 4, as a kind is written and registered. `gesteme_hmms` has the
HMMs that several kinds share, `task_level` the level above them, `hmm` the models of chapter 2.1.
"""
