"""What stands on a table, from depth images: measured against exact shapes, and as scene files from recordings."""
