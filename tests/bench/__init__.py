"""Figures: each measured against a floor of the same run, never against another machine's.

`make bench` measures all of them in full; the tests here
measure each in a short form, with room for a busy machine but none for a regression.
"""
