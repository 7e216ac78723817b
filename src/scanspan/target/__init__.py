"""Where it lands: what is visible at each sample, how two of these merge, and how samples become a picture in a file."""
