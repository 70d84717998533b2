"""Tests of cards in other languages."""
