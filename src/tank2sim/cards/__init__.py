"""What is known of a ship: its card, read with precise errors, converted once, written back without loss."""
