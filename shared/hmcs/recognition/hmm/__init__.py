"""Hidden Markov models (thesis 2.1.2): arrays in, arrays out."""
