"""Trees as text, dot, SVG and HTML."""
