"""The figures of the thesis, made anew: drawn, and told with the numbers of what is drawn."""
