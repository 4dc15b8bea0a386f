"""What the safety of the stack is worth, in figures: campaigns that take minutes to hours."""
