"""The figures of the thesis, made anew: drawn, with the numbers of what is drawn."""
