"""Trees of splats: how points are ordered, merged into coarser ones, encoded in blocks, kept in a file, and read again."""
