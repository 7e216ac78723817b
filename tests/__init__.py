"""The tests of scanspan, and the oracles they compare it with."""
