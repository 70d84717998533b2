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

_PORT = (
    r"\b(port|left|bb|backbord|babord|ps|l|prt|ptt|links|babor|izquierd[oa]|bakboord|sinistr[oa]|lew[aye]j?|bombordo"
    r"|bagbord|paapuuri|vasen|iskele)\b"
)
_STARBOARD = (
    r"\b(stbd|starboard|right|stb|steuerbord|tribord|sb|r|strb|rechts|estribor|derech[oa]|stuurboord|dritta|destr[oa]"
    r"|styrbord|praw[aye]j?|boreste|estibordo|tyyrpuuri|oikea|sancak)\b"
)
_ORDER = (
    r"\b(orders?|ordered|ord|cmd|commands?|commanded|demand|set|setpoint|soll|desired|ref|reference|target|commande"
    r"|consigne|ordre|orden|ordenado|ordine|comando|gewenste|onsket|zadan[aye]|nastawa|ordem|beordrad|onskad|beordret|ohje|komento|emir|emri|komut\w*|istenen|\w*(?:sollwert|kommando|commando|befehl|ordre|kasky))\b"
)
_RUDDER = (
    r"\b(rudder|rud|ruder\w*|helm|delta|rsa|barre|barra|timone?|gouvernail|roer\w*|ror(?:vinkel|utslag|kommando|ordre|udslag)?"
    r"|roder\w*|steering|steru?|leme|perasin\w*|dumen)\b"
)
_REVOLUTIONS = (
    r"\b(rpm|\w*drehzahl|revs|revolutions|umdrehungen|giri|tours|regime|revoluciones|\w*toerental|\w*turtall"
    r"|obr(?:oty|otow|otowa)?|rotac(?:ao|oes)|\w*varvtal|\w*omdrejning\w*|\w*kierrosluku|kierrokset|devir|devri)\b"
)
_SHAFT = rf"{_REVOLUTIONS}|\b(shaft|propeller|engine|n|helice|elica|arbre|sruby|walu|potkuri\w*|pervane)\b"
_NOT_SPEED = r"\b(temp\w*|torque|fuel|power|load|pressure|flow|hours|current|alarm|limit)\b"
_THRUST = (
    r"\b(thrust|thruster|thrusters|thr|schub|motor|motors|moteur|motore|throttle|propulsor|propulseur|propulsore|esc|pwm"
    r"|fahrhebel|stuwkracht|\w*padrag|ster strumieniowy|pednik|silnik|\w*potkuri|moottori|itici|motoru|cmd|command)\b"
)
_WIND = (
    r"\b(wind(?:geschw\w*|richtung|snelheid|richting|speed|angle)?|wnd|awa|aws|twa|tws|twd|vent|viento|vento"
    r"|vind|vindhastighe[td]|vindretning|vindriktning|wiatru?|tuul(?:i|en)|ruzgar)\b"
)
_FROM = (
    r"\b(dir|direction|angle|winkel|angulo|angolo|\w*richtung|\w*richting|\w*retning|\w*riktning|kierunek|kat"
    r"|direcao|\w*vinkel|suunta|kulma|yonu|acisi|awa|twd)\b"
)
_TRUE = r"\b(true|wahr\w*|vrai|real|reale|rzeczywist\w*|verdadeir[oa]|sann?|sand|todellinen|gercek|tw[asd])\b"
_WATER = (
    r"\b(water|stw|wassers?|log|through|eau|surface|agua|superficie|acqua|vannet|vattnet|vandet|loggfart|wody|wodzie"
    r"|veden|vedessa|suya)\b"
)
_GROUND = r"\b(ground|grund|sog|over|gps|fondo?|fundo|grond|suolo|grunn|dnem|dna|pohjan|yere)\b"
_RATE_WORDS = (
    r"\b(rot|yawrate|yaw rate|turn rate|rate of turn|drehgeschw\w*|drehrate|wendegeschw\w*|gyr ?z|gyro ?z|omega ?z"
    r"|wz|angular velocity z|rate ?turn|taux de giration|vitesse de (?:giration|rotation)|(?:velocidad|regimen) de giro"
    r"|draaisnelheid|bochtaanwijzer|velocita (?:di accostata|angolare)|svinghastighet|dreiehastighet"
    r"|predkosc (?:katowa|zwrotu|obrotu)|(?:taxa|velocidade|razao) de (?:guinada|giro)|girhastighet"
    r"|svanghastighet|vridhastighet"
    r"|drejehastighed|kaantymisnopeus|kulmanopeus|donu?s hizi|donme hizi)\b|^r$"
)
_SPEED_WORDS = (
    r"\b(speed|spd|fahrt|vitesse|velocity|\w*geschw\w*|sog|stw|velocidad|velocita|snelheid|grondsnelheid|fart"
    r"|\w*fart|predkosc|velocidade|nopeus|hiz|hizi)\b"
)
_TRANSVERSE = r"\b(transverse|trans|lateral|sway|quer\w*|transversal|tvar\w*|poprzeczn[ay])\b"

_PATTERNS: tuple[tuple[str, str, str], ...] = (
    # quantity, words that must be there, words that must not
    # An x or y alone may be of any axes, mirrored ones among them: only names that say north and east are taken.
    ("x", r"^(x|pos|position)? ?(n|north|northing)( position| pos)?( m)?$|^x ned( m)?$", r"^n$"),
    ("y", r"^(y|pos|position)? ?(e|east|easting)( position| pos)?( m)?$|^y ned( m)?$", r"^e$"),
    (
        "latitude",
        r"\b(lat|latitude|breite|breitengrad|latitud|latitudine|breedte|breedtegraad|bredde|breddegrad|szerokosc"
        r"|leveys(?:aste|piiri)?|enlem)\b",
        r"\b(lateral|accel\w*|latency)\b",
    ),
    (
        "longitude",
        r"\b(lon|lng|long|longitude|lange|laenge|langengrad|laengengrad|longitud|longitudine|lengte|lengtegraad|lengde"
        r"|lengdegrad|laengde|laengdegrad|dlugosc|pituus(?:aste|piiri)?|boylam)\b",
        r"\b(longitudinal|speed|spd|water|accel\w*)\b",
    ),
    ("wind_direction", rf"(?=.*{_WIND})(?=.*{_TRUE})(?=.*({_FROM}|\btwa\b))", ""),
    ("wind_speed", rf"(?=.*{_WIND})(?=.*{_TRUE})(?!.*{_FROM})", ""),
    ("wind_rel_direction", rf"(?=.*{_WIND})(?=.*{_FROM})", _TRUE),
    ("wind_rel_speed", _WIND, rf"{_FROM}|{_TRUE}|\b(temp\w*|chill|gust\w*)\b"),
    ("thrust_order_port", rf"(?=.*{_THRUST})(?=.*{_PORT})", rf"{_REVOLUTIONS}|{_RUDDER}|{_NOT_SPEED}"),
    ("thrust_order_starboard", rf"(?=.*{_THRUST})(?=.*{_STARBOARD})", rf"{_REVOLUTIONS}|{_RUDDER}|{_NOT_SPEED}"),
    ("rpm_port", rf"(?=.*({_SHAFT}))(?=.*{_PORT})", rf"\b(order|cmd|command)\b|{_NOT_SPEED}"),
    ("rpm_starboard", rf"(?=.*({_SHAFT}))(?=.*{_STARBOARD})", rf"\b(order|cmd|command)\b|{_NOT_SPEED}"),
    ("rudder_order", rf"(?=.*{_RUDDER})(?=.*{_ORDER})", ""),
    ("rudder_angle", _RUDDER, rf"{_ORDER}|\b(trim|mode|limit|alarm)\b"),
    (
        "rpm_order",
        rf"(?=.*({_SHAFT})|.*\btelegraph\b|.*\bthrottle\b)(?=.*({_ORDER}|\btelegraph\b))",
        _RUDDER,
    ),
    ("rpm", _SHAFT, _NOT_SPEED),
    ("yaw_rate", _RATE_WORDS, r"\b(desired|set|error|ref)\b"),
    (
        "magnetic_heading",
        r"(?=.*\b(heading|hdg|compass|kompass)\b)(?=.*\b(mag|magnetic|compass|kompass|hdm)\b)|\bhdm\b"
        r"|\b(kurs kompasowy|kompassisuunta|manyetik pruva)\b",
        r"\b(true|gps|gnss)\b",
    ),
    (
        "heading",
        r"\b(heading|hdg|hdt|psi|yaw|steuerkurs|gyro|cap|true heading|kreiselkurs|rumbo|proa|prua|gyrokoers|gyrokurs"
        r"|vorausrichtung|voorliggende koers|ware koers|kurs rechtweisend|rettvisende kurs|stevnet kurs"
        r"|kurs (?:rzeczywisty|zyroskopowy|zyrokompasowy)|rumo (?:verdadeiro|da giro)|aproamento"
        r"|(?:kompass)?kurs rattvisande"
        r"|stavad kurs|styret kurs|keulasuunta|hyrrasuunta|pruva)\b",
        r"\b(rate|speed|acc|accel\w*|error|err|desired|des|set|cmd|ref|control|mag|u|r|e|x|y|z|fondo?|fundo|grunn|grond|suolo|grund)\b",
    ),
    (
        "cog",
        r"\b(cog|track|course|crs|route|rotta|kug|grondkoers|beholden kurs|grundkurs"
        r"|(?:kat )?drogi|kulkusuunta)\b"
        rf"|(?=.*\b(kurs|koers|rumbo|rumo|rota|suunta)\b)(?=.*{_GROUND})",
        r"\b(error|cross|desired|speed|set|planned|ordered|to)\b",
    ),
    ("v_water", rf"(?=.*{_TRANSVERSE})(?=.*{_SPEED_WORDS})(?!.*\b(ground|grund)\b)", ""),
    ("v_ground", rf"(?=.*{_TRANSVERSE})(?=.*{_SPEED_WORDS})(?=.*\b(ground|grund)\b)", ""),
    ("u_water", rf"(?=.*{_SPEED_WORDS})(?=.*{_WATER})|\b(stw|fd ?w|loggefahrt)\b", _TRANSVERSE),
    (
        "sog",
        rf"(?=.*{_SPEED_WORDS})(?=.*{_GROUND})|\b(grondsnelheid|fug|fart o grunn|grundfart)\b",
        rf"{_TRANSVERSE}|\b(wind|water)\b",
    ),
    ("a_x", r"\b(acc|accel|acceleration)\b.*\bx\b|\b(accx|ax)\b", ""),
    ("a_y", r"\b(acc|accel|acceleration)\b.*\by\b|\b(accy|ay)\b", ""),
    (
        "heel",
        r"\b(heel|roll|phi|krangung|kraengung|rollwinkel|roulis|gite|escora|balance|slagzij|helling|sbandamento|rollio"
        r"|krengning|rull|przechyl|adernamento|banda|balanco|krangning|rullning|kraengning|kallistu(?:s|ma)|yalpa|meyil)\b",
        r"\b(rate|desired|speed|batt\w*|cell\w*)\b",
    ),
)
_COMPILED = tuple(
    (name, re.compile(wanted), re.compile(barred) if barred else None) for name, wanted, barred in _PATTERNS
)


_SIGNAL_K = re.compile(r"^(navigation|propulsion|steering|environment)\.[a-z]")


def unit_of_signal_k(name: str, quantity: str) -> str:
    """Unit of a path of Signal K, which is SI (signalk.org, 1.7), revolutions in Hz; empty of any other name.

    Parameters
    ----------
    name : str
    quantity : str
        A key of :data:`QUANTITIES`, or empty.

    Examples
    --------
    >>> unit_of_signal_k("propulsion.main.revolutions", "rpm")
    '1/s'
    """
    if not quantity or not _SIGNAL_K.match(name):
        return ""
    return "1/s" if name.endswith(".revolutions") else next(iter(QUANTITIES[quantity].units))


_LETTERS = str.maketrans({"ø": "o", "æ": "ae", "ß": "ss", "ł": "l", "ı": "i"})
"""Letters that are not one of a to z with an accent."""


def plain_words(name: str) -> str:
    """Small letters without accents, words separated by single spaces: ``/ship/shaftRPM`` is ``ship shaft rpm``."""
    text = _without_accents(re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name))
    return re.sub(r"[^a-z0-9]+", " ", text).strip()


def _without_accents(text: str) -> str:
    """Small letters without accents."""
    text = unicodedata.normalize("NFKD", text.lower().translate(_LETTERS))
    return "".join(letter for letter in text if not unicodedata.combining(letter))


def quantity_of_name(name: str) -> str:
    """Quantity that the words of a name suggest; empty if they suggest none.

    English, German, French, Spanish, Portuguese, Italian, Dutch, Danish, Norwegian, Swedish, Finnish, Polish, Turkish,
    and the abbreviations of NMEA are known. A number behind a word is not part of it (``ROT1``).
    """
    words = re.sub(r"(?<=[a-z])(?=\d)", " ", plain_words(name))
    for quantity, wanted, barred in _COMPILED:
        if wanted.search(words) and not (barred and barred.search(words)):
            return quantity
    return ""


_ANOTHER = re.compile(
    r"\b(temp\w*|volt\w*|battery|batt|current|amps?|depth|tiefe|fuel|pressure|baro\w*|humidity|hdop|pdop|satellites|sats"
    r"|error|status|id|mode|pitch|trim|alt|altitude|load|power|torque)\b"
)


def names_another(name: str) -> bool:
    """Whether the words of a name say that it is none of the quantities: a temperature, a voltage, a depth."""
    return bool(_ANOTHER.search(plain_words(name)))


def names_thrust(name: str) -> bool:
    """Whether the words of a name say that it is of thrusters or motors, of whatever side: ``/usv/thrusters[0]``.

    Examples
    --------
    >>> names_thrust("/usv/thrusters.data[1]"), names_thrust("/battery.current")
    (True, False)
    """
    words = re.sub(r"(?<=[a-z])(?=\d)", " ", plain_words(name))
    return bool(re.search(_THRUST, words)) and not re.search(rf"{_REVOLUTIONS}|{_RUDDER}|{_NOT_SPEED}", words)


def names_rest(name: str) -> bool:
    """Whether the words of a name say that its values are the pulse at which a controller rests.

    Examples
    --------
    >>> names_rest("thr_left_pwm_zero_point"), names_rest("thr_left")
    (True, False)
    """
    return bool(re.search(r"\b(zero|neutral|trim|rest|idle|center|centre|mid|middle)\b", plain_words(name)))


def sign_of_name(name: str) -> int:
    """Sign that a name states, -1 where port is positive (``Ruderlage (Bb +)``), 1 where starboard is, 0 if none."""
    text = _without_accents(name).replace("_", " ")
    text = re.sub(r"\b(positive?|pos|positiv)\b\.?", "+", text)
    port, starboard = (words.removeprefix(r"\b(").removesuffix(r")\b") for words in (_PORT, _STARBOARD))
    for words, sign in ((port, -1), (starboard, 1)):
        if re.search(rf"\b({words})\s*\+|\+\s*(to\s+)?({words})\b", text):
            return sign
    return 0
