"""Open Inventor scenes: read from text and binary files, traversed with Inventor's state, and written."""
