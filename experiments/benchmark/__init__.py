"""Speed of every part, measured beside its peers: a module for each section."""
