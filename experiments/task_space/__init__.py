"""Task-space mapping: what stands on a table, from depth images, measured against exact shapes; and scene files from recordings."""
