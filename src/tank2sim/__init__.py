"""tank2sim: from what a towing tank or a sea trial measured to a ship model inside a simulator."""

__version__ = "0.1.0"
