"""The likelihood of an explanation: a Kalman filter about the measured motion."""
