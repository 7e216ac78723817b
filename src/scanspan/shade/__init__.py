"""What colour a visible sample has: normals, light, textures, and the way between sRGB and linear light."""
