"""Studies and figures: recognition and assistance measured, beside other methods.

Open `study` first: what a study is. `studies` has all of them, `methods` what they compare, `data`
the motions they use, `figures` the figures of the thesis.
"""
