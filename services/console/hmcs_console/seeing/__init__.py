"""What is heard, and one moment of it to be drawn."""
