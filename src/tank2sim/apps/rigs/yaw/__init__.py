"""Added yaw inertia and dissipation from records of a yaw rig (Alyshev 2019)."""
