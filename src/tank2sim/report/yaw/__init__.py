"""The page of the yaw rig."""
