"""What comes in: meshes, materials, scenes, cameras and the files they are read from, all checked here, once."""
