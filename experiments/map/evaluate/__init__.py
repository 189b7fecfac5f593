"""How true a map is: generated worlds with exact distances, other methods on the same data, real frames."""
