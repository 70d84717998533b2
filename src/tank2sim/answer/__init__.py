"""The answer of a command: declared once, shown on the screen, as a page, as pictures and as JSON."""
