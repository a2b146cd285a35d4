"""The DisGNet paper's experiments, tables and figures, each beside the paper's own numbers."""
