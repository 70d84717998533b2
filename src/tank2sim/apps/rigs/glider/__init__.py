"""Steady and transient flight of an underwater glider."""
