"""Hidden Markov models (thesis 2.1.2): evaluation, decoding, learning; arrays in, arrays out."""
