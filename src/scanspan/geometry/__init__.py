"""Where it is: scenes become triangles in clip space, which are clipped, projected and snapped to the sub-pixel grid."""
