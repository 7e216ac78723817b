"""How you see it: several pictures on one sheet, and the numbers beside a picture."""
