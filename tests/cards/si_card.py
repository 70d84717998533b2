"""A card whose numbers are dimensional."""

from __future__ import annotations

SI_CARD = """
format = "tank2sim-ship/1"
[ship]
name = "Test ship"
length_m = 100.0
source = "made up"
[environment]
water_density_kgpm3 = 1000.0
[model]
kind = "abkowitz"
speed_mps = 10.0
scaling = "dimensional"
speed_scale = "nominal"
yaw_rate_terms = "hydrodynamic"
rudder_sign = "port"
[rigid_body]
mass = 5e6          # kg
yaw_inertia = 3.2e9
x_G = 1.0
[derivatives]
Yv = -6e5           # N per m/s
Yr = 1.5e7          # N per rad/s
Nr = -1.2e9         # N m per rad/s
Yd = 1.1e6          # N per rad
Nvvr = -4e8
Xdd = -5e5
Yvdot = -4e6
Nrdot = -2e9
"""
