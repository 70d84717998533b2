"""The kinds of charts, their looks, and pictures of them."""
