"""Files read and written: recordings of depth, motions of people, maps, points."""
