"""Accelerations by waves: a narrow-band process, which rises and falls at about one frequency.

    a = Re z,   dz/dt = (-1/time + i frequency) z + white noise
    E[a(t) a(t + s)] = level^2 exp(-|s|/time) cos(frequency s)

The stochastic cycle of Harvey (1989), Forecasting, Structural Time Series Models and the Kalman Filter, section 2.3.3,
in continuous time (ibid., 9.7). Fossen (2011), Handbook of Marine Craft Hydrodynamics and Motion Control, 8.2.6, has
the same band as a second-order filter of white noise; time is 1 over damping ratio times frequency there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tank2sim.arrays import Array


@dataclass(frozen=True, eq=False)
class OverBlock:
    """A band over a block.

    Parameters
    ----------
    fading : complex
        z at the end by z at the beginning.
    gain : complex
        Integral of z over the block by z at its beginning, s; that of a is the real part of the product.
    end, way : array (3,)
        Variances of what noise within the block adds to a at its end, and to the integral of a.
    with_value, with_quadrature : array (3,)
        Covariances of what noise adds to the integral of a, with what it adds to real and imaginary part of z.
    """

    fading: complex
    gain: complex
    end: Array
    way: Array
    with_value: Array
    with_quadrature: Array


@dataclass(frozen=True, eq=False)
class WaveBand:
    """A narrow band of unmodelled accelerations.

    Parameters
    ----------
    level : array (3,)
        Standard deviation in surge, sway (m/s2) and yaw (rad/s2).
    frequency : float
        Frequency of the middle of the band, rad/s.
    time : float
        In which the correlation from one wave to later ones falls to 1/e, s.
    """

    level: Array
    frequency: float
    time: float

    @property
    def period_s(self) -> float:
        """Period of the middle of the band, s."""
        return float(2 * np.pi / self.frequency)

    @property
    def motion(self) -> dict[str, float]:
        """Standard deviation of the motion that the waves cause, by variable, SI.

        Acceleration over frequency, and over its square: a hull's damping is small at the frequency of waves. North and
        east share surge and sway evenly.
        """
        speeds = self.level / self.frequency
        place = float(np.sqrt(np.mean(speeds[:2] ** 2)) / self.frequency)
        return {
            **dict(zip(("motion.u", "motion.v", "motion.r"), map(float, speeds), strict=True)),
            "motion.psi": float(speeds[2] / self.frequency),
            "motion.x": place,
            "motion.y": place,
        }

    def moved(self, band: Array, heading: Array) -> Array:
        """The motion that waves cause: u, v (m/s), r (rad/s), psi (rad), x, y (m) (..., 6).

        As for :attr:`motion`: a = Re z integrated once is Im z/frequency, twice -Re z/frequency^2.

        Parameters
        ----------
        band : array (..., 6)
            z of surge, sway and yaw: real part and imaginary part of each in turn, m/s2 and rad/s2.
        heading : array (...)
            rad.
        """
        speeds, places = band[..., 1::2] / self.frequency, -band[..., ::2] / self.frequency**2
        cos, sin = np.cos(heading), np.sin(heading)
        north = cos * places[..., 0] - sin * places[..., 1]
        east = sin * places[..., 0] + cos * places[..., 1]
        return np.concatenate([speeds, places[..., 2:], north[..., None], east[..., None]], axis=-1)

    def over(self, block_s: float) -> OverBlock:
        """The band over a block of a length in seconds.

        Examples
        --------
        >>> import numpy as np
        >>> block = WaveBand(np.ones(3), frequency=0.0, time=10.0).over(5.0)
        >>> bool(np.isclose(block.fading, np.exp(-0.5)))
        True
        """
        rate = complex(-1 / self.time, self.frequency)
        fading = np.exp(rate * block_s)
        gain = (fading - 1) / rate
        # E|integral of z|^2 and E[integral of z times conj z(end)], less the share of z at the beginning
        square = 2 * np.real(-block_s / rate + gain / rate) - abs(gain) ** 2
        cross = np.conj(gain) - gain * np.conj(fading)
        variance = self.level**2
        return OverBlock(
            complex(fading),
            complex(gain),
            variance * (1 - abs(fading) ** 2),
            variance * square,
            variance * cross.real,
            -variance * cross.imag,
        )
