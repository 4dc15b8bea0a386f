"""Hidden Markov models (thesis 2.1.2): evaluation, decoding, learning; arrays in, arrays out.

Open `model` first: a model and what can be asked of it. `inference` has the forward, backward and
Viterbi recursions, `learning` Baum–Welch, `densities` the emissions, `topologies` the transition
matrices to start from.
"""
