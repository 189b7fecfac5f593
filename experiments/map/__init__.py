"""Maps a recording of depth images or point clouds: a distance field, its points and statistics."""
