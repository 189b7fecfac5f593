"""Measure how the arm avoids what stands and who comes: whole episodes against the exact geometry, each behaviour with the part
switched off beside it."""
