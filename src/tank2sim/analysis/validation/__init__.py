"""What practice asks of a card: comparison with other cards, validation, and the data for the bridge."""
