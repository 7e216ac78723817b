"""Readers of model files and the modules they share; `load` in the folder above chooses a reader and checks what it returns."""
