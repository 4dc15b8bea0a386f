"""Studies and figures: what recognition is worth, measured."""
