"""The programs, one folder each; no program imports another. `python -m experiments` lists them."""
