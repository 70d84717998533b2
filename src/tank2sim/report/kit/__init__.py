"""What every page is made of: the page, its theme, charts, numbers and values from JSON."""
