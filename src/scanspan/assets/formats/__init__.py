"""Readers of model files, one module a format; `load` in the folder above chooses among them and checks what they return."""
