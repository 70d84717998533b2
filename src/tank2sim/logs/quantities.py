"""Quantities that a log may hold: their units, and the words that names of columns and topics use for them."""

from __future__ import annotations

import math
import re
import unicodedata
from dataclasses import dataclass

from tank2sim.units import KNOT_MPS

_ANGLE = {"rad": 1.0, "deg": math.pi / 180}
_RATE = {"rad/s": 1.0, "deg/s": math.pi / 180, "deg/min": math.pi / 180 / 60}
_SPEED = {"m/s": 1.0, "kn": KNOT_MPS, "km/h": 1 / 3.6}
_TURNS = {"rad/s": 1.0, "rpm": 2 * math.pi / 60, "1/s": 2 * math.pi}
_SHARE = {"1": 1.0, "%": 0.01}
_DEGREES = {"deg": 1.0, "rad": 180 / math.pi, "1e-7 deg": 1e-7}
_LENGTH = {"m": 1.0}
_ACCELERATION = {"m/s2": 1.0, "g": 9.80665}


@dataclass(frozen=True)
class LogQuantity:
    """A quantity that a channel of a log may hold.

    Parameters
    ----------
    name : str
    words : str
        For people.
    units : dict
        Unit to the factor that gives SI (rad, m/s, rad/s; degrees for latitude and longitude); the first is SI.
    column : str
        Signal of the trial format that it becomes; empty if it becomes none.
    """

    name: str
    words: str
    units: dict[str, float]
    column: str = ""


QUANTITIES: dict[str, LogQuantity] = {
    quantity.name: quantity
    for quantity in (
        LogQuantity("latitude", "latitude, + north", _DEGREES),
        LogQuantity("longitude", "longitude, + east", _DEGREES),
        LogQuantity("x", "position to north", _LENGTH, "x_m"),
        LogQuantity("y", "position to east", _LENGTH, "y_m"),
        LogQuantity("sog", "speed over ground", _SPEED, "sog_mps"),
        LogQuantity("cog", "course over ground", _ANGLE, "cog_rad"),
        LogQuantity("heading", "true heading", _ANGLE, "psi_rad"),
        LogQuantity("magnetic_heading", "magnetic heading", _ANGLE),
        LogQuantity("yaw_rate", "rate of turn, + starboard", _RATE, "r_radps"),
        LogQuantity("rudder_angle", "rudder angle, + starboard", _ANGLE | _SHARE, "delta_rad"),
        LogQuantity("port_rudder_angle", "angle of the port rudder, + starboard", _ANGLE),
        LogQuantity("rudder_order", "rudder order, + starboard", _ANGLE | _SHARE, "delta_order_rad"),
        LogQuantity("rpm", "revolutions of the propeller, + ahead", _TURNS, "n_radps"),
        LogQuantity("rpm_port", "revolutions of the port propeller, + ahead", _TURNS),
        LogQuantity("rpm_starboard", "revolutions of the starboard propeller, + ahead", _TURNS),
        LogQuantity("rpm_order", "ordered revolutions, + ahead", _TURNS | _SHARE),
        LogQuantity("thrust_order_port", "order to the port thruster, + ahead", _SHARE),
        LogQuantity("thrust_order_starboard", "order to the starboard thruster, + ahead", _SHARE),
        LogQuantity("u_water", "speed ahead through the water", _SPEED, "u_mps"),
        LogQuantity("v_water", "speed to starboard through the water", _SPEED, "v_mps"),
        LogQuantity("u_ground", "speed ahead over the ground", _SPEED, "u_ground_mps"),
        LogQuantity("v_ground", "speed to starboard over the ground", _SPEED, "v_ground_mps"),
        LogQuantity("v_north", "velocity to north", _SPEED),
        LogQuantity("v_east", "velocity to east", _SPEED),
        LogQuantity("heel", "heel, + to starboard", _ANGLE, "phi_rad"),
        LogQuantity("wind_rel_speed", "apparent wind speed", _SPEED, "wind_rel_speed_mps"),
        LogQuantity(
            "wind_rel_direction", "apparent wind from, + starboard of the bow", _ANGLE, "wind_rel_direction_rad"
        ),
        LogQuantity("wind_theoretical_speed", "wind speed off the bow", _SPEED),
        LogQuantity("wind_theoretical_direction", "wind from, off the bow", _ANGLE),
        LogQuantity("wind_speed", "true wind speed", _SPEED, "wind_speed_mps"),
        LogQuantity("wind_direction", "true wind from", _ANGLE, "wind_direction_rad"),
        LogQuantity("a_x", "acceleration ahead", _ACCELERATION),
        LogQuantity("a_y", "acceleration to starboard", _ACCELERATION),
        LogQuantity("ignore", "none of them", {"": 1.0}),
    )
}
"""Every quantity of a channel. Signs are those of the trial format: starboard, ahead and clockwise are positive."""

_PORT = r"\b(port|left|bb|backbord|babord|ps|l|prt|ptt)\b"
_STARBOARD = r"\b(stbd|starboard|right|stb|steuerbord|tribord|sb|r|strb)\b"
_ORDER = r"\b(order|orders|ordered|cmd|command|commanded|demand|set|setpoint|soll|desired|ref|reference|target)\b"
_RUDDER = r"\b(rudder|ruder|ruderlage|helm|delta|rsa|barre|timon|roer|steering)\b"
_SHAFT = r"\b(rpm|shaft|wellendrehzahl|drehzahl|propeller|revs|revolutions|engine|umdrehungen|n)\b"
_THRUST = r"\b(thrust|thruster|thrusters|schub|motor|motors|throttle|propulsor|esc|pwm)\b"
_WIND = r"\b(wind|wnd|awa|aws|twa|tws|twd)\b"
_WATER = r"\b(water|stw|wasser|log|through|eau)\b"
_GROUND = r"\b(ground|grund|sog|over|gps|fond)\b"
_RATE_WORDS = (
    r"\b(rot|yawrate|yaw rate|turn rate|rate of turn|drehgeschw\w*|drehrate|wendegeschw\w*|gyr ?z|gyro ?z|omega ?z"
    r"|wz|angular velocity z|rate ?turn)\b|^r$"
)
_SPEED_WORDS = r"\b(speed|spd|fahrt|vitesse|velocity|geschw\w*|sog|stw)\b"

_PATTERNS: tuple[tuple[str, str, str], ...] = (
    # quantity, words that must be there, words that must not
    ("latitude", r"\b(lat|latitude|breite)\b", r"\b(lateral|accel\w*|latency)\b"),
    ("longitude", r"\b(lon|lng|long|longitude|lange|laenge|länge)\b", r"\b(longitudinal|speed|accel\w*)\b"),
    (
        "wind_direction",
        rf"(?=.*{_WIND})(?=.*\b(true|wahr\w*|twd)\b)(?=.*\b(dir|direction|richtung\w*|angle|twd)\b)",
        "",
    ),
    ("wind_speed", rf"(?=.*{_WIND})(?=.*\b(true|wahr\w*|tws)\b)(?!.*\b(dir|direction|angle)\b)", ""),
    (
        "wind_rel_direction",
        r"(?=.*\b(wind|windrichtung|awa)\b)(?=.*\b(dir|direction|angle|windrichtung|richtung|awa|winkel)\b)",
        r"\b(twa|true)\b",
    ),
    ("wind_rel_speed", r"\b(wind|aws|windgeschw\w*)\b", r"\b(dir|direction|angle|windrichtung|true|twa|tws|twd)\b"),
    ("thrust_order_port", rf"(?=.*{_THRUST})(?=.*{_PORT})", r"\b(rpm|drehzahl|current|temp\w*)\b"),
    ("thrust_order_starboard", rf"(?=.*{_THRUST})(?=.*{_STARBOARD})", r"\b(rpm|drehzahl|current|temp\w*)\b"),
    ("rpm_port", rf"(?=.*{_SHAFT})(?=.*{_PORT})", r"\b(order|cmd|command|temp\w*|torque)\b"),
    ("rpm_starboard", rf"(?=.*{_SHAFT})(?=.*{_STARBOARD})", r"\b(order|cmd|command|temp\w*|torque)\b"),
    ("rudder_order", rf"(?=.*{_RUDDER})(?=.*{_ORDER})", ""),
    ("rudder_angle", _RUDDER, _ORDER),
    ("rpm_order", rf"(?=.*{_SHAFT}|.*\btelegraph\b|.*\bthrottle\b)(?=.*({_ORDER}|\btelegraph\b))", _RUDDER),
    ("rpm", _SHAFT, r"\b(temp\w*|torque|fuel|power|load|pressure)\b"),
    ("yaw_rate", _RATE_WORDS, r"\b(desired|set|error|ref)\b"),
    (
        "magnetic_heading",
        r"(?=.*\b(heading|hdg|compass|kompass)\b)(?=.*\b(mag|magnetic|compass|kompass|hdm)\b)|\bhdm\b",
        "",
    ),
    (
        "heading",
        r"\b(heading|hdg|hdt|psi|yaw|steuerkurs|gyro|cap|true heading|kreiselkurs|rumbo)\b",
        r"\b(rate|speed|error|err|desired|des|set|cmd|ref|control|mag|u|r|e|x|y|z)\b",
    ),
    (
        "cog",
        rf"\b(cog|track|course|route)\b|(?=.*\bkurs\b)(?=.*{_GROUND})",
        r"\b(error|cross|desired|speed)\b",
    ),
    (
        "v_water",
        rf"(?=.*\b(transverse|lateral|sway|quer\w*)\b)(?=.*{_SPEED_WORDS})(?!.*\b(ground|grund)\b)",
        "",
    ),
    ("v_ground", rf"(?=.*\b(transverse|lateral|sway|quer\w*)\b)(?=.*{_SPEED_WORDS})(?=.*\b(ground|grund)\b)", ""),
    ("u_water", rf"(?=.*({_SPEED_WORDS}|\bstw\b))(?=.*{_WATER})", r"\b(transverse|lateral|quer\w*)\b"),
    ("sog", rf"(?=.*{_SPEED_WORDS})(?=.*{_GROUND})", r"\b(transverse|lateral|wind|water)\b"),
    ("a_x", r"\b(acc|accel|acceleration)\b.*\bx\b|\b(accx|ax)\b", ""),
    ("a_y", r"\b(acc|accel|acceleration)\b.*\by\b|\b(accy|ay)\b", ""),
    ("heel", r"\b(heel|roll|phi|krangung|krängung|rollwinkel)\b", r"\b(rate|desired|speed)\b"),
)
_COMPILED = tuple(
    (name, re.compile(wanted), re.compile(barred) if barred else None) for name, wanted, barred in _PATTERNS
)


def plain_words(name: str) -> str:
    """Small letters without accents, words separated by single spaces: ``/ship/shaftRPM`` is ``ship shaft rpm``."""
    text = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name)
    text = unicodedata.normalize("NFKD", text.lower())
    text = "".join(letter for letter in text if not unicodedata.combining(letter))
    return re.sub(r"[^a-z0-9]+", " ", text).strip()


def quantity_of_name(name: str) -> str:
    """Quantity that the words of a name suggest; empty if they suggest none.

    English, German and the abbreviations of NMEA are known.
    """
    words = plain_words(name)
    for quantity, wanted, barred in _COMPILED:
        if wanted.search(words) and not (barred and barred.search(words)):
            return quantity
    return ""


def sign_of_name(name: str) -> int:
    """Sign that a name states, -1 where port is positive (``Ruderlage (Bb +)``), 1 where starboard is, 0 if none."""
    text = name.lower().replace("positive", "+").replace("pos.", "+")
    if re.search(r"(\b(bb|port|backbord|ps)\s*\+|\+\s*(to\s+)?(bb|port|backbord|ps)\b)", text):
        return -1
    if re.search(r"(\b(stb|stbd|starboard|steuerbord|sb)\s*\+|\+\s*(to\s+)?(stb|stbd|starboard|steuerbord)\b)", text):
        return 1
    return 0
