"""Measures how well a body is followed in noisy images: surfaces, body regions, speeds; options in `config`, images in `seen`, tracks
in `tracks`, the exact geometry in `truth`, rows and bars in `rows`."""
