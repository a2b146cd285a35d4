"""A machine in the browser: to look at, to drive by sliders and by hand, to keep as a page."""
