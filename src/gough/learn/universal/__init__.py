"""One network for every hexapod: random machines, the network, its training and its file."""
