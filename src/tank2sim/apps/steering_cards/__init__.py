"""Published steering models side by side on one ship."""
