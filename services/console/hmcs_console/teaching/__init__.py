"""Recording, labeling, training, and taking over what was trained."""
