"""A machine in the browser: moved by sliders or by hand, playing a file, saved as a page."""
