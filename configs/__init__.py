"""Named, documented settings of the programs."""
