"""Report: figures and one self-contained page."""
