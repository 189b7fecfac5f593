"""Gestures of hands as commands to the arm: train and evaluate the classifier, and read commands from a video."""
