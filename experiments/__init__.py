"""The programs, each a folder of its own that no other program imports: `python -m experiments` lists them."""
