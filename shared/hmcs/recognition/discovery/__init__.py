"""States found in demonstrations that carry no labels."""
