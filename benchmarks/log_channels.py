"""Channels found without a mapping, in made-up voyages written in many ways.

Each seed makes a voyage of a ship (Nomoto's equation with loss of speed and drift) or of a craft with two thrusters
(`benchmarks/craft_log.py`), and writes it: six of eight as CSV, with names of nine loggers and languages, of which some
say nothing, units in names, in a row of their own or nowhere, signs to port, delays, preambles, separators, decimal
commas, encodings, forms of time, slow streams repeated or left empty, and columns that are nothing of use; the others
as ROS bag, NMEA 0183, ArduPilot dataflash or PX4 ULog with outputs on any number. `tank2sim log` reads it. Each channel
that is in the log is right if its values in SI are those of the truth (and, in a CSV, its column the right one),
undecided if it is not used, else wrong; a channel that is used and not in the log is wrong, too. Nothing here is
shared with the reader.

    python benchmarks/log_channels.py [NUMBER OF VOYAGES] [FIRST SEED] [-v] [--unknown]

With `--unknown` all are tables in two languages that the reader does not know, positions excepted.
"""

from __future__ import annotations

import math
import struct
import sys
import tempfile
from collections import Counter
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta, timezone
from operator import xor
from pathlib import Path

import numpy as np
from craft_log import random_craft, simulated

import tank2sim as t2s
from tank2sim.errors import InputError

KNOT = 1852 / 3600
ANGLES = ("heading", "cog", "wind_rel_direction")
SURE = 0.9

UNITS = {  # unit: how it is spelt, and units in SI (degrees of position excepted)
    "deg": (("deg", "°", "degrees"), math.radians(1)),
    "rad": (("rad",), 1.0),
    "deg/s": (("deg/s", "°/s"), math.radians(1)),
    "deg/min": (("deg/min", "°/min"), math.radians(1) / 60),
    "rad/s": (("rad/s",), 1.0),
    "kn": (("kn", "kts", "knots"), KNOT),
    "m/s": (("m/s",), 1.0),
    "km/h": (("km/h",), 1 / 3.6),
    "rpm": (("rpm", "1/min"), math.pi / 30),
    "Hz": (("Hz",), 2 * math.pi),
    "%": (("%",), 0.01),
    "1": (("",), 1.0),
}
KINDS = {
    "sog": ("kn", "kn", "m/s", "km/h"),
    "u_water": ("kn", "kn", "m/s"),
    "v_water": ("kn", "m/s"),
    "wind_rel_speed": ("m/s", "kn"),
    "cog": ("deg", "deg", "rad"),
    "heading": ("deg", "deg", "deg", "rad"),
    "wind_rel_direction": ("deg",),
    "heel": ("deg",),
    "yaw_rate": ("deg/min", "deg/s", "rad/s"),
    "rudder_angle": ("deg", "deg", "deg", "rad"),
    "rudder_order": ("deg", "deg", "%"),
    "rpm": ("rpm",),
    "rpm_port": ("rpm",),
    "rpm_starboard": ("rpm",),
    "thrust_order_port": ("%", "1"),
    "thrust_order_starboard": ("%", "1"),
}
DECIMALS = {
    "deg": 1, "rad": 4, "deg/s": 2, "deg/min": 1, "rad/s": 5, "kn": 2, "m/s": 2, "km/h": 2, "rpm": 1, "Hz": 3, "%": 1,
    "1": 3,
}  # fmt: skip

NAMES: dict[str, dict[str, tuple[str, ...]]] = {
    # logger or language: quantity to names that are used for it
    "english": {
        "time": ("time", "Timestamp", "UTC time", "Date/Time"),
        "latitude": ("lat", "Latitude", "GPS latitude", "gps_lat"),
        "longitude": ("lon", "Longitude", "GPS longitude", "gps_lon"),
        "sog": ("SOG", "Speed over ground", "gps_speed", "ground speed"),
        "cog": ("COG", "Course over ground", "gps_course", "Track made good"),
        "heading": ("Heading", "HDG true", "gyro heading", "Hdg (T)", "yaw"),
        "yaw_rate": ("ROT", "Rate of turn", "yaw rate", "gyro_z", "turn_rate"),
        "u_water": ("STW", "Speed through water", "log speed", "water speed longitudinal"),
        "v_water": ("Transverse speed through water", "sway speed water"),
        "rudder_angle": ("Rudder", "rudder angle", "Rudder position", "rudder_fb", "Actual rudder", "RSA"),
        "rudder_order": ("Rudder order", "rudder_cmd", "Rudder setpoint", "commanded rudder", "helm order"),
        "rpm": ("RPM", "shaft speed rpm", "Propeller revs", "Engine RPM", "shaft_rpm"),
        "rpm_port": ("port rpm", "RPM left", "left_motor_rpm", "esc_left_rpm"),
        "rpm_starboard": ("starboard rpm", "RPM right", "right_motor_rpm", "esc_right_rpm"),
        "thrust_order_port": ("left thruster", "thruster_port_cmd", "motor left", "throttle_l", "cmd_left"),
        "thrust_order_starboard": ("right thruster", "thruster_stbd_cmd", "motor right", "throttle_r", "cmd_right"),
        "wind_rel_speed": ("Apparent wind speed", "AWS", "Wind speed (rel)"),
        "wind_rel_direction": ("Apparent wind angle", "AWA", "Wind angle (rel)"),
        "heel": ("Roll", "heel"),
    },
    "german": {
        "time": ("Zeit", "Uhrzeit", "Zeitstempel"),
        "latitude": ("Breite", "Breitengrad", "geogr. Breite"),
        "longitude": ("Länge", "Längengrad", "geogr. Länge"),
        "sog": ("Fahrt über Grund", "FüG", "Geschwindigkeit über Grund"),
        "cog": ("Kurs über Grund", "KüG"),
        "heading": ("Kurs rechtweisend", "Steuerkurs", "Kreiselkurs", "Vorausrichtung"),
        "yaw_rate": ("Drehgeschwindigkeit", "Drehrate", "Wendegeschwindigkeit"),
        "u_water": ("Fahrt durchs Wasser", "FdW", "Loggefahrt"),
        "v_water": ("Quergeschwindigkeit durchs Wasser",),
        "rudder_angle": ("Ruder", "Ruderlage", "Ruderwinkel", "Ruder Ist"),
        "rudder_order": ("Ruder Soll", "Rudersollwert", "Ruderkommando", "Ruderlage Soll"),
        "rpm": ("Drehzahl", "Wellendrehzahl", "Propellerdrehzahl"),
        "rpm_port": ("Drehzahl Bb", "Drehzahl Backbord", "Drehzahl links"),
        "rpm_starboard": ("Drehzahl Stb", "Drehzahl Steuerbord", "Drehzahl rechts"),
        "thrust_order_port": ("Schub Bb", "Fahrhebel Bb", "Motor links Soll"),
        "thrust_order_starboard": ("Schub Stb", "Fahrhebel Stb", "Motor rechts Soll"),
        "wind_rel_speed": ("Wind relativ", "scheinbarer Wind Geschwindigkeit"),
        "wind_rel_direction": ("Windrichtung relativ", "scheinbarer Wind Winkel"),
        "heel": ("Krängung", "Rollwinkel"),
    },
    "french": {
        "time": ("Heure", "Horodatage"),
        "latitude": ("Latitude",),
        "longitude": ("Longitude",),
        "sog": ("Vitesse fond", "Vitesse sur le fond"),
        "cog": ("Route fond", "Route sur le fond"),
        "heading": ("Cap", "Cap vrai", "Cap gyro"),
        "yaw_rate": ("Taux de giration", "Vitesse de rotation", "Vitesse de giration"),
        "u_water": ("Vitesse surface", "Vitesse eau"),
        "rudder_angle": ("Barre", "Angle de barre", "Angle de gouvernail"),
        "rudder_order": ("Consigne de barre", "Ordre de barre"),
        "rpm": ("Régime hélice", "Tours hélice", "Vitesse arbre"),
        "rpm_port": ("Tours bâbord", "Régime moteur bâbord"),
        "rpm_starboard": ("Tours tribord", "Régime moteur tribord"),
        "thrust_order_port": ("Propulseur bâbord", "Commande moteur bâbord"),
        "thrust_order_starboard": ("Propulseur tribord", "Commande moteur tribord"),
        "wind_rel_speed": ("Vent apparent vitesse",),
        "wind_rel_direction": ("Vent apparent angle",),
        "heel": ("Gîte", "Roulis"),
    },
    "spanish": {
        "time": ("Hora", "Fecha y hora"),
        "latitude": ("Latitud",),
        "longitude": ("Longitud",),
        "sog": ("Velocidad sobre el fondo", "Velocidad fondo"),
        "cog": ("Rumbo sobre el fondo", "Rumbo fondo"),
        "heading": ("Rumbo verdadero", "Rumbo giroscópico", "Proa"),
        "yaw_rate": ("Velocidad de giro", "Régimen de giro"),
        "u_water": ("Velocidad en el agua",),
        "rudder_angle": ("Timón", "Ángulo de timón", "Ángulo del timón"),
        "rudder_order": ("Orden de timón", "Timón ordenado"),
        "rpm": ("Revoluciones", "Revoluciones hélice"),
        "rpm_port": ("Revoluciones babor", "RPM babor"),
        "rpm_starboard": ("Revoluciones estribor", "RPM estribor"),
        "thrust_order_port": ("Propulsor babor", "Motor izquierdo"),
        "thrust_order_starboard": ("Propulsor estribor", "Motor derecho"),
        "wind_rel_speed": ("Viento aparente velocidad",),
        "wind_rel_direction": ("Viento aparente ángulo",),
        "heel": ("Escora", "Balance"),
    },
    "dutch": {
        "time": ("Tijd", "Tijdstip"),
        "latitude": ("Breedte", "Breedtegraad"),
        "longitude": ("Lengte", "Lengtegraad"),
        "sog": ("Snelheid over de grond", "Grondsnelheid"),
        "cog": ("Koers over de grond", "Grondkoers"),
        "heading": ("Voorliggende koers", "Gyrokoers", "Ware koers"),
        "yaw_rate": ("Draaisnelheid", "Bochtaanwijzer"),
        "u_water": ("Snelheid door het water",),
        "rudder_angle": ("Roer", "Roerhoek", "Roerstand"),
        "rudder_order": ("Roercommando", "Gewenste roerhoek"),
        "rpm": ("Toerental", "Schroeftoerental"),
        "rpm_port": ("Toerental BB", "Toerental bakboord"),
        "rpm_starboard": ("Toerental SB", "Toerental stuurboord"),
        "thrust_order_port": ("Stuwkracht bakboord", "Motor bakboord"),
        "thrust_order_starboard": ("Stuwkracht stuurboord", "Motor stuurboord"),
        "wind_rel_speed": ("Schijnbare windsnelheid",),
        "wind_rel_direction": ("Schijnbare windrichting",),
        "heel": ("Slagzij", "Helling"),
    },
    "italian": {
        "time": ("Ora", "Data e ora"),
        "latitude": ("Latitudine",),
        "longitude": ("Longitudine",),
        "sog": ("Velocità al suolo", "Velocità sul fondo"),
        "cog": ("Rotta al suolo", "Rotta sul fondo"),
        "heading": ("Prua", "Prua vera", "Prua bussola giroscopica"),
        "yaw_rate": ("Velocità di accostata", "Velocità angolare"),
        "u_water": ("Velocità acqua",),
        "rudder_angle": ("Timone", "Angolo timone", "Angolo di barra"),
        "rudder_order": ("Comando timone", "Ordine timone"),
        "rpm": ("Giri elica", "Giri asse"),
        "rpm_port": ("Giri sinistra", "Giri motore sinistro"),
        "rpm_starboard": ("Giri dritta", "Giri motore destro"),
        "thrust_order_port": ("Comando motore sinistro", "Propulsore sinistro"),
        "thrust_order_starboard": ("Comando motore destro", "Propulsore destro"),
        "wind_rel_speed": ("Vento apparente velocità",),
        "wind_rel_direction": ("Vento apparente angolo",),
        "heel": ("Sbandamento", "Rollio"),
    },
    "norwegian": {
        "time": ("Tid", "Tidspunkt"),
        "latitude": ("Breddegrad", "Bredde"),
        "longitude": ("Lengdegrad", "Lengde"),
        "sog": ("Fart over grunn", "Fart o. grunn"),
        "cog": ("Kurs over grunn", "Beholden kurs"),
        "heading": ("Rettvisende kurs", "Stevnet kurs", "Gyrokurs"),
        "yaw_rate": ("Svinghastighet", "Dreiehastighet"),
        "u_water": ("Fart gjennom vannet",),
        "rudder_angle": ("Ror", "Rorvinkel", "Rorutslag"),
        "rudder_order": ("Rorkommando", "Ønsket rorvinkel", "Rorordre"),
        "rpm": ("Turtall", "Propellturtall"),
        "rpm_port": ("Turtall babord", "Turtall BB"),
        "rpm_starboard": ("Turtall styrbord", "Turtall SB"),
        "thrust_order_port": ("Pådrag babord", "Thruster babord"),
        "thrust_order_starboard": ("Pådrag styrbord", "Thruster styrbord"),
        "wind_rel_speed": ("Relativ vindhastighet",),
        "wind_rel_direction": ("Relativ vindretning",),
        "heel": ("Krengning", "Rull"),
    },
    "signal_k": {
        "time": ("timestamp",),
        "latitude": ("navigation.position.latitude",),
        "longitude": ("navigation.position.longitude",),
        "sog": ("navigation.speedOverGround",),
        "cog": ("navigation.courseOverGroundTrue",),
        "heading": ("navigation.headingTrue",),
        "yaw_rate": ("navigation.rateOfTurn",),
        "u_water": ("navigation.speedThroughWater",),
        "rudder_angle": ("steering.rudderAngle",),
        "rudder_order": ("steering.autopilot.target.rudderAngle",),
        "rpm": ("propulsion.main.revolutions",),
        "rpm_port": ("propulsion.port.revolutions",),
        "rpm_starboard": ("propulsion.starboard.revolutions",),
        "thrust_order_port": ("propulsion.port.throttle",),
        "thrust_order_starboard": ("propulsion.starboard.throttle",),
        "wind_rel_speed": ("environment.wind.speedApparent",),
        "wind_rel_direction": ("environment.wind.angleApparent",),
        "heel": ("navigation.attitude.roll",),
    },
    "recorder": {  # of a voyage data recorder or a bridge simulator
        "time": ("DATE_TIME", "UTC_TIME"),
        "latitude": ("GPS1_LAT", "POS_LAT", "OwnShip.Lat"),
        "longitude": ("GPS1_LON", "POS_LON", "OwnShip.Lon"),
        "sog": ("GPS1_SOG", "SPD_SOG", "OwnShip.SpeedOverGround"),
        "cog": ("GPS1_COG", "CRS_COG", "OwnShip.CourseOverGround"),
        "heading": ("GYRO1_HDG", "HDG_TRUE", "OwnShip.Heading"),
        "yaw_rate": ("ROT1", "GYRO1_ROT", "OwnShip.RateOfTurn"),
        "u_water": ("LOG_STW", "SPD_WATER_LONG", "OwnShip.SpeedThroughWater"),
        "v_water": ("SPD_WATER_TRANS",),
        "rudder_angle": ("RUD_ACT", "RUDDER1_ANGLE", "OwnShip.RudderAngle"),
        "rudder_order": ("RUD_ORD", "RUDDER1_ORDER", "OwnShip.RudderOrder"),
        "rpm": ("ENG1_RPM", "SHAFT1_RPM", "OwnShip.PropellerRpm"),
        "rpm_port": ("RPM_PORT", "RPM_PS"),
        "rpm_starboard": ("RPM_STBD", "RPM_SB"),
        "thrust_order_port": ("THR_PORT_ORD", "ThrustPort"),
        "thrust_order_starboard": ("THR_STBD_ORD", "ThrustStbd"),
        "wind_rel_speed": ("WIND_REL_SPD",),
        "wind_rel_direction": ("WIND_REL_DIR",),
        "heel": ("ROLL_ANGLE", "HEEL"),
    },
    "portuguese": {
        "time": ("timestamp",),
        "latitude": ("lat",),
        "longitude": ("lon",),
        "sog": ("Velocidade no fundo", "Velocidade de fundo"),
        "cog": ("Rumo no fundo", "Rota no fundo"),
        "heading": ("Rumo verdadeiro", "Aproamento", "Rumo da giro"),
        "yaw_rate": ("Taxa de guinada", "Velocidade de guinada"),
        "u_water": ("Velocidade na superfície", "Velocidade na água"),
        "v_water": ("Velocidade transversal na água",),
        "rudder_angle": ("Leme", "Ângulo do leme"),
        "rudder_order": ("Ordem de leme", "Comando do leme"),
        "rpm": ("Rotação do eixo", "Rotações do hélice"),
        "rpm_port": ("Rotação bombordo",),
        "rpm_starboard": ("Rotação boreste",),
        "thrust_order_port": ("Propulsor de bombordo",),
        "thrust_order_starboard": ("Propulsor de boreste",),
        "wind_rel_speed": ("Velocidade do vento aparente",),
        "wind_rel_direction": ("Direção do vento aparente",),
        "heel": ("Adernamento", "Balanço"),
    },
    "swedish": {
        "time": ("timestamp",),
        "latitude": ("latitude",),
        "longitude": ("longitude",),
        "sog": ("Fart över grund", "Grundfart"),
        "cog": ("Kurs över grund", "Grundkurs"),
        "heading": ("Kompasskurs rättvisande", "Stävad kurs", "Gyrokurs"),
        "yaw_rate": ("Girhastighet", "Svänghastighet"),
        "u_water": ("Fart genom vattnet", "Loggfart"),
        "v_water": ("Tvärfart genom vattnet",),
        "rudder_angle": ("Roder", "Rodervinkel", "Roderläge"),
        "rudder_order": ("Roderkommando", "Beordrad rodervinkel"),
        "rpm": ("Varvtal", "Propellervarvtal"),
        "rpm_port": ("Varvtal babord",),
        "rpm_starboard": ("Varvtal styrbord",),
        "thrust_order_port": ("Gaspådrag babord",),
        "thrust_order_starboard": ("Gaspådrag styrbord",),
        "wind_rel_speed": ("Skenbar vindhastighet",),
        "wind_rel_direction": ("Skenbar vindriktning",),
        "heel": ("Krängning", "Rullning"),
    },
    "polish": {
        "time": ("Czas", "Czas UTC"),
        "latitude": ("Szerokość geograficzna", "Szerokość"),
        "longitude": ("Długość geograficzna", "Długość"),
        "sog": ("Prędkość nad dnem", "Prędkość względem dna"),
        "cog": ("Kurs nad dnem", "Kąt drogi nad dnem"),
        "heading": ("Kurs rzeczywisty", "Kurs żyroskopowy"),
        "yaw_rate": ("Prędkość kątowa", "Prędkość zwrotu"),
        "u_water": ("Prędkość po wodzie", "Prędkość względem wody"),
        "rudder_angle": ("Ster", "Kąt steru", "Wychylenie steru"),
        "rudder_order": ("Zadany kąt steru", "Ster zadany"),
        "rpm": ("Obroty", "Obroty śruby", "Obroty wału"),
        "rpm_port": ("Obroty lewej śruby",),
        "rpm_starboard": ("Obroty prawej śruby",),
        "thrust_order_port": ("Silnik lewy",),
        "thrust_order_starboard": ("Silnik prawy",),
        "wind_rel_speed": ("Prędkość wiatru pozornego",),
        "wind_rel_direction": ("Kierunek wiatru pozornego",),
        "heel": ("Przechył",),
    },
    "danish": {
        "time": ("Tid", "Tidspunkt"),
        "latitude": ("Breddegrad", "Bredde"),
        "longitude": ("Længdegrad", "Længde"),
        "sog": ("Fart over grunden",),
        "cog": ("Kurs over grunden",),
        "heading": ("Styret kurs", "Gyrokurs"),
        "yaw_rate": ("Drejehastighed",),
        "u_water": ("Fart gennem vandet",),
        "rudder_angle": ("Ror", "Rorvinkel", "Rorudslag"),
        "rudder_order": ("Rorordre", "Beordret rorvinkel"),
        "rpm": ("Omdrejninger", "Omdrejningstal"),
        "rpm_port": ("Omdrejninger bagbord",),
        "rpm_starboard": ("Omdrejninger styrbord",),
        "thrust_order_port": ("Motor bagbord",),
        "thrust_order_starboard": ("Motor styrbord",),
        "wind_rel_speed": ("Relativ vindhastighed",),
        "wind_rel_direction": ("Relativ vindretning",),
        "heel": ("Krængning",),
    },
    "finnish": {
        "time": ("Aika",),
        "latitude": ("Leveysaste", "Leveyspiiri"),
        "longitude": ("Pituusaste", "Pituuspiiri"),
        "sog": ("Nopeus pohjan suhteen",),
        "cog": ("Suunta pohjan suhteen", "Kulkusuunta"),
        "heading": ("Keulasuunta", "Hyrräsuunta"),
        "yaw_rate": ("Kääntymisnopeus", "Kulmanopeus"),
        "u_water": ("Nopeus veden suhteen",),
        "rudder_angle": ("Peräsin", "Peräsinkulma"),
        "rudder_order": ("Peräsinkäsky", "Peräsin ohje"),
        "rpm": ("Kierrosluku", "Potkurin kierrosluku"),
        "rpm_port": ("Kierrosluku paapuuri",),
        "rpm_starboard": ("Kierrosluku tyyrpuuri",),
        "thrust_order_port": ("Moottori paapuuri",),
        "thrust_order_starboard": ("Moottori tyyrpuuri",),
        "wind_rel_speed": ("Suhteellinen tuulen nopeus",),
        "wind_rel_direction": ("Suhteellinen tuulen suunta",),
        "heel": ("Kallistus",),
    },
    "turkish": {
        "time": ("Zaman", "Saat"),
        "latitude": ("Enlem",),
        "longitude": ("Boylam",),
        "sog": ("Yere göre hız",),
        "cog": ("Yere göre rota",),
        "heading": ("Pruva", "Gerçek pruva"),
        "yaw_rate": ("Dönüş hızı", "Dönme hızı"),
        "u_water": ("Suya göre hız",),
        "rudder_angle": ("Dümen", "Dümen açısı"),
        "rudder_order": ("Dümen komutu", "Dümen emri"),
        "rpm": ("Devir", "Pervane devri"),
        "rpm_port": ("İskele devir",),
        "rpm_starboard": ("Sancak devir",),
        "thrust_order_port": ("İskele itici",),
        "thrust_order_starboard": ("Sancak itici",),
        "wind_rel_speed": ("Bağıl rüzgâr hızı",),
        "wind_rel_direction": ("Bağıl rüzgâr yönü",),
        "heel": ("Yalpa", "Meyil"),
    },
}
UNKNOWN: dict[str, dict[str, tuple[str, ...]]] = {
    # languages that the reader does not know: written once, after its words, and not looked at since
    "croatian": {
        "time": ("timestamp",),
        "latitude": ("lat",),
        "longitude": ("lon",),
        "sog": ("Brzina preko dna", "Brzina nad dnom"),
        "cog": ("Kurs preko dna", "Putni kut"),
        "heading": ("Pravi kurs", "Pramčanica", "Žirokurs"),
        "yaw_rate": ("Brzina okretanja", "Kutna brzina"),
        "u_water": ("Brzina kroz vodu",),
        "v_water": ("Poprečna brzina kroz vodu",),
        "rudder_angle": ("Kormilo", "Kut kormila", "Otklon kormila"),
        "rudder_order": ("Zapovijed kormila", "Zadani kut kormila"),
        "rpm": ("Okretaji", "Broj okretaja vijka"),
        "rpm_port": ("Okretaji lijevo",),
        "rpm_starboard": ("Okretaji desno",),
        "thrust_order_port": ("Potisak lijevo",),
        "thrust_order_starboard": ("Potisak desno",),
        "wind_rel_speed": ("Prividna brzina vjetra",),
        "wind_rel_direction": ("Prividni smjer vjetra",),
        "heel": ("Nagib", "Valjanje"),
    },
    "estonian": {
        "time": ("timestamp",),
        "latitude": ("latitude",),
        "longitude": ("longitude",),
        "sog": ("Kiirus põhja suhtes",),
        "cog": ("Teekond põhja suhtes", "Teenurk"),
        "heading": ("Tõeline kurss", "Vööri suund", "Gürokurss"),
        "yaw_rate": ("Pöördekiirus", "Nurkkiirus"),
        "u_water": ("Kiirus vee suhtes", "Logi kiirus"),
        "v_water": ("Põikkiirus vee suhtes",),
        "rudder_angle": ("Rool", "Roolinurk"),
        "rudder_order": ("Rooli käsk", "Antud roolinurk"),
        "rpm": ("Pöörded", "Sõukruvi pöörded"),
        "rpm_port": ("Pöörded vasak parras",),
        "rpm_starboard": ("Pöörded parem parras",),
        "thrust_order_port": ("Tõukejõud vasak",),
        "thrust_order_starboard": ("Tõukejõud parem",),
        "wind_rel_speed": ("Suhteline tuule kiirus",),
        "wind_rel_direction": ("Suhteline tuule suund",),
        "heel": ("Kreen", "Rullumine"),
    },
}
COMMAS = (
    *("german", "french", "spanish", "dutch", "italian", "norwegian"),
    *("portuguese", "swedish", "polish", "danish", "finnish", "turkish"),
)
TO_PORT = {  # how a language says that port is positive
    "english": " (port +)", "german": " (Bb +)", "recorder": "_PORT_POS", "french": " (+ bâbord)",
    "spanish": " (babor +)", "dutch": " (BB +)", "italian": " (sinistra +)", "norwegian": " (babord +)",
}  # fmt: skip
SILENT = ("ch", "AI_", "value", "Signal ", "P", "analog")
DISTRACTORS = (
    ("battery voltage", 24.0, 0.3), ("Engine temperature", 78.0, 2.0), ("depth", 25.0, 6.0), ("hdop", 0.9, 0.1),
    ("Satellites", 11.0, 1.0), ("cross track error", 0.0, 8.0), ("Fuel flow", 120.0, 9.0), ("pitch", 0.0, 0.8),
    ("air temp", 17.0, 0.4), ("current_A", 14.0, 4.0), ("ID", 7.0, 0.0), ("Barometer hPa", 1013.0, 0.4),
    ("set course", 90.0, 0.0), ("Status", 1.0, 0.0), ("Trim", 0.4, 0.01),
)  # fmt: skip


@dataclass
class Made:
    """A voyage: times (n,), s, truth by quantity in SI, degrees of position, and metres to north and east."""

    kind: str
    time: np.ndarray
    truth: dict[str, np.ndarray]
    x: np.ndarray
    y: np.ndarray


@dataclass
class Written:
    """What is in a log: quantity to its column (empty if it has no name of its own), and whether it can be known."""

    path: Path
    columns: dict[str, str] = field(default_factory=dict)
    unknowable: set[str] = field(default_factory=set)
    style: str = ""


# Motion -------------------------------------------------------------------------------------------------------------


def slow(rng: np.random.Generator, n: int, size: float, time_s: float, step: float) -> np.ndarray:
    """A first-order Gauss-Markov series."""
    keep = math.exp(-step / time_s)
    noise = rng.normal(size=n) * size * math.sqrt(1 - keep**2)
    out = np.empty(n)
    value = size * rng.normal()
    for k in range(n):
        value = keep * value + noise[k]
        out[k] = value
    return out


def ship(rng: np.random.Generator) -> Made:
    """Nomoto's equation of the first order with a term in r|r|, loss of speed and drift in a turn; 10 Hz."""
    length, speed = rng.uniform(60, 300), rng.uniform(4, 10)
    gain, constant = rng.uniform(0.8, 2.0) * speed / length, rng.uniform(0.6, 2.0) * length / speed
    pivot, loss = rng.uniform(0.25, 0.45) * length, rng.uniform(0.15, 0.4)
    rate_limit = math.radians(rng.uniform(2.3, 5))
    base = rng.uniform(60, 140) * math.pi / 30
    step, n = 0.1, round(rng.uniform(800, 1200) / 0.1)
    psi, r, delta, u, engine = rng.uniform(-math.pi, math.pi), 0.0, 0.0, speed, 1.0
    plan = [(60.0, "hold", 0.0), (1e9, "zigzag", math.radians(rng.choice([10, 20])) * rng.choice([-1, 1]))]
    side = rng.choice([-1, 1])
    plan += [(60.0, "hold", 0.0), (rng.uniform(150, 260), "turn", side * math.radians(rng.uniform(15, 35)))]
    plan += [(90.0, "hold", 0.0), (rng.uniform(80, 160), "turn", -side * math.radians(rng.uniform(10, 30)))]
    plan += [(1e9, "hold", 0.0)]
    place, begin, order, base_psi, turns = 0, 0.0, 0.0, psi, 0
    rows = []
    for k in range(n):
        t = k * step
        seconds, what, angle = plan[place]
        if what == "zigzag":
            if order == 0.0 or turns == 0:
                order, base_psi, turns = angle, psi, 1
            if (psi - base_psi) * math.copysign(1, order) > abs(angle):
                order, turns = -order, turns + 1
        elif what == "turn":
            order = angle
        elif k % 20 == 0:
            order = round(math.degrees(float(np.clip(-8 * r + 0.4 * math.sin(t / 37) / 10, -0.1, 0.1)))) * math.pi / 180
        if t - begin > seconds or (what == "zigzag" and (turns > 4 or t - begin > 350)):
            place, begin = place + 1, t
            if what == "turn":
                engine = rng.uniform(0.7, 1.1)
        delta += float(np.clip(order - delta, -rate_limit * step, rate_limit * step))
        r += step * (gain * delta - r - 4 * r * abs(r) * length / speed) / constant
        psi += step * r
        u += step * (speed * engine * (1 - loss * min(1.0, abs(r) * length / speed)) - u) / 40
        rows.append((psi, r, delta, order, u, -pivot * r, base * engine * (1 - 0.1 * abs(r) * length / speed)))
    psi_, r_, delta_, order_, u_, v_, n_ = np.array(rows).T
    truth = {"heading": psi_, "yaw_rate": r_, "rudder_angle": delta_, "rudder_order": order_}
    truth |= {"u_water": u_, "v_water": v_, "rpm": n_, "heel": 0.6 * r_ * u_ + slow(rng, n, 0.01, 3, step)}
    current = rng.uniform(0, 0.5) * np.exp(1j * rng.uniform(0, 2 * math.pi))
    track = np.cumsum((u_ + 1j * v_) * np.exp(1j * psi_) + current) * step
    return over_ground("ship", np.arange(n) * step, truth, track, rng)


def craft(rng: np.random.Generator) -> Made:
    """A craft with two thrusters; 5 Hz."""
    c = random_craft(rng)
    motion = simulated(c, rng)
    truth = {"heading": motion["psi"], "yaw_rate": motion["r"], "heel": slow(rng, len(motion["t"]), 0.03, 1, 0.2)}
    truth |= {"u_water": motion["u"], "v_water": motion["v"]}
    truth |= {"rpm_port": motion["n_port"], "rpm_starboard": motion["n_starboard"]}
    truth |= {"thrust_order_port": motion["order_port"], "thrust_order_starboard": motion["order_starboard"]}
    return over_ground("craft", motion["t"], truth, motion["x"] + 1j * motion["y"], rng)


def over_ground(
    kind: str,
    time: np.ndarray,
    truth: dict[str, np.ndarray],
    track: np.ndarray,
    rng: np.random.Generator,
) -> Made:
    """Speed and course over the ground, and apparent wind, of a track (n,), m, north + 1j east."""
    step = time[1] - time[0]
    velocity = np.gradient(track, time)
    x, y = track.real, track.imag
    size = 0.2 if kind == "craft" else 0.8
    x, y = (part + slow(rng, len(x), size, 50, step) for part in (x, y))
    wind = rng.uniform(1, 8) * np.exp(1j * rng.uniform(0, 2 * math.pi)) * (1 + slow(rng, len(x), 0.1, 20, step))
    air = (wind - velocity) * np.exp(-1j * truth["heading"])  # where the air goes, in axes of the vessel
    latitude0, longitude0 = rng.uniform(-60, 60), rng.uniform(-180, 180)
    truth |= {"sog": np.abs(velocity), "cog": np.angle(velocity) % (2 * math.pi)}
    truth |= {"latitude": latitude0 + x / 111_200, "wind_rel_speed": np.abs(air)}
    truth["longitude"] = longitude0 + y / (111_320 * math.cos(math.radians(latitude0)))
    truth["wind_rel_direction"] = np.angle(-air) % (2 * math.pi)
    return Made(kind, time, truth, x, y)


NOISE = {
    "sog": 0.04, "u_water": 0.04, "v_water": 0.03, "cog": 0.02, "heading": 0.002, "yaw_rate": 0.0004,
    "rudder_angle": 0.002, "rpm": 0.03, "rpm_port": 0.4, "rpm_starboard": 0.4, "wind_rel_speed": 0.3,
    "wind_rel_direction": 0.04, "heel": 0.002,
}  # fmt: skip
"""White noise of the instruments, SI."""


def measured(made: Made, name: str, at: np.ndarray, rng: np.random.Generator, delay: float = 0.0) -> np.ndarray:
    """What an instrument shows at times (k,): the truth a delay before, with noise."""
    values = made.truth[name]
    if name in ("cog", "wind_rel_direction"):
        values = np.unwrap(values)
    if "order" in name:
        found = values[np.clip(np.searchsorted(made.time, at - delay, side="right") - 1, 0, None)]
    else:
        found = np.interp(at - delay, made.time, values)
    factor = 3.0 if made.kind == "craft" and name == "heading" else 1.0
    found = found + factor * NOISE.get(name, 0.0) * rng.normal(size=len(at))
    return found % (2 * math.pi) if name in ANGLES else found


# CSV ----------------------------------------------------------------------------------------------------------------


def write_csv(
    made: Made, path: Path, rng: np.random.Generator, vocabulary: dict[str, dict[str, tuple[str, ...]]]
) -> Written:
    """A table."""
    table = Table(made, path, rng, vocabulary)
    for name in table.wanted():
        table.add(name)
    table.distract()
    table.write()
    return table.out


class Table:
    """A table as one logger writes it, column by column."""

    def __init__(
        self, made: Made, path: Path, rng: np.random.Generator, vocabulary: dict[str, dict[str, tuple[str, ...]]]
    ) -> None:
        self.made, self.rng, self.is_ship = made, rng, made.kind == "ship"
        style = str(rng.choice(list(vocabulary)))
        self.names, self.out = vocabulary[style], Written(path, style=style)
        self.step = float(rng.choice([0.2, 0.5, 1.0]) if self.is_ship else 0.2)
        self.at = np.arange(0, made.time[-1], self.step)
        self.si = style == "signal_k"
        self.where = "" if self.si else str(rng.choice(["name", "row", "none"], p=[0.45, 0.25, 0.3]))
        self.spelt_first = rng.random() < 0.5
        self.silent_share = float(rng.choice([0.0, 0.0, 0.35]))
        self.stem = str(rng.choice(SILENT))
        self.slow_step = float(rng.choice([self.step, 1.0, 2.0] if self.is_ship else [0.2, 0.2, 1.0]))
        self.repeated = rng.random() < 0.5
        self.thrust_unit = "1" if self.si else str(rng.choice(["%", "1"]))
        self.comma = style in COMMAS and rng.random() < 0.7
        self.columns: list[tuple[str, str, list[str]]] = []  # name, unit, cells

    def wanted(self) -> list[str]:
        """Quantities of the table."""
        rng = self.rng
        optional = {"sog": 0.8, "cog": 0.8, "yaw_rate": 0.7, "u_water": 0.5, "v_water": 0.3, "heel": 0.4}
        optional |= {"wind_rel_speed": 0.4}
        wanted = ["latitude", "longitude", "heading"]
        wanted += [name for name, share in optional.items() if rng.random() < share]
        if "wind_rel_speed" in wanted:
            wanted.append("wind_rel_direction")
        measured_too, ordered_too = [(True, False), (False, True), (True, True)][rng.integers(3)]
        self.both = measured_too and ordered_too
        if self.is_ship:
            wanted += ["rudder_angle"] * measured_too + ["rudder_order"] * ordered_too + ["rpm"]
        for side in () if self.is_ship else ("port", "starboard"):
            wanted += [f"rpm_{side}"] * measured_too + [f"thrust_order_{side}"] * ordered_too
        return [name for name in wanted if name in self.names]

    def add(self, name: str) -> None:
        """Write a column."""
        unit, sign = self._unit(name), 1
        if name in ("rudder_angle", "rudder_order", "yaw_rate") and not self.si and self.rng.random() < 0.25:
            sign = -1
        values, digits = self._values(name), 7
        if name not in ("latitude", "longitude"):
            factor = math.radians(35) / 100 if name == "rudder_order" and unit == "%" else UNITS[unit][1]
            values = sign * values / factor
            digits = DECIMALS[unit] + int(self.rng.random() < 0.3)
        if name == "heading" and unit == "deg" and self.rng.random() < 0.2:
            values = np.where(values > 180, values - 360, values)  # -180 to 180
        values = np.where(self.rng.random(len(values)) < 0.003, np.nan, values)
        label, silent = self._label(name, sign)
        shown = self._spelt(name, unit)
        if silent and self.rng.random() < 0.6:
            shown = ""
        if self.where == "name" and shown:
            label, shown = self._with_unit(label, shown)
        self._note_unknowable(name, silent, bool(shown) or self.si)
        self.columns.append((label, shown, cells_of(values, digits)))
        self.out.columns[name] = label

    def _unit(self, name: str) -> str:
        unit = str(self.rng.choice(KINDS.get(name, ("deg",))))
        if name.startswith("thrust_order"):
            return self.thrust_unit
        if not self.si:
            return unit
        si = {"deg": "rad", "kn": "m/s", "km/h": "m/s", "deg/min": "rad/s", "deg/s": "rad/s", "rpm": "Hz", "%": "1"}
        return si.get(unit, unit)

    def _values(self, name: str) -> np.ndarray:
        """Values of the instrument in SI, late by its delay, a slow one's repeated or not."""
        delay = 0.0
        if name in ("heading", "yaw_rate", "rudder_angle", "sog", "cog") and self.rng.random() < 0.3:
            delay = float(self.rng.uniform(0.1, 1.0 if self.is_ship else 0.3))
        if name not in ("latitude", "longitude", "sog", "cog") or self.slow_step <= self.step:
            return measured(self.made, name, self.at, self.rng, delay)
        instants = np.floor(self.at / self.slow_step + 1e-9) * self.slow_step
        fresh = np.concatenate([[True], np.diff(instants) > 0])
        values = measured(self.made, name, instants[fresh], self.rng, delay)[np.cumsum(fresh) - 1]
        return values if self.repeated else np.where(fresh, values, np.nan)

    def _label(self, name: str, sign: int) -> tuple[str, bool]:
        """Name of a column, and whether it says nothing."""
        label = str(self.rng.choice(self.names[name]))
        may_be_silent = name in ("heading", "sog", "cog", "yaw_rate", "rudder_angle", "rudder_order")
        if may_be_silent and self.rng.random() < self.silent_share:
            return f"{self.stem}{len(self.columns) + 1}", True
        if sign < 0 and name.startswith("rudder") and self.rng.random() < 0.5:
            label += TO_PORT.get(self.out.style, "")
        return label, False

    def _spelt(self, name: str, unit: str) -> str:
        """How the unit is written; empty where it is not."""
        if self.where not in ("name", "row"):
            return ""
        if name in ("latitude", "longitude"):
            return str(self.rng.choice(["", "deg", "°"]))
        spellings = UNITS[unit][0]
        return spellings[0] if self.spelt_first else str(self.rng.choice(spellings))

    def _with_unit(self, label: str, shown: str) -> tuple[str, str]:
        """Name of a column with the unit in it, and the unit if it is there."""
        brackets = "_{}" if self.out.style == "recorder" else str(self.rng.choice([" [{}]", " ({})", "_{}"]))
        if brackets == "_{}" and ("°" in shown or shown in ("%", "1/min")):
            return label, ""
        return label + brackets.format(shown.replace("/", "_") if brackets == "_{}" else shown), shown

    def _note_unknowable(self, name: str, silent: bool, has_unit: bool) -> None:
        """Note what nobody could find: units of what no other column shows; twins without a name."""
        if name in ("wind_rel_speed", "v_water", "heel") and not has_unit:
            self.out.unknowable.add(name)
        if silent and ((self.both and name.startswith("rudder")) or (not self.is_ship and name in ("sog", "cog"))):
            self.out.unknowable.add(name)

    def distract(self) -> None:
        """Add columns that are nothing of use."""
        n = len(self.at)
        for place in self.rng.choice(len(DISTRACTORS), size=self.rng.integers(0, 5), replace=False):
            name, mean, size = DISTRACTORS[place]
            values = mean + slow(self.rng, n, size, 60, self.step) + 0.1 * size * self.rng.normal(size=n)
            self.columns.append((name, "", cells_of(values, 2 if size else 0)))

    def write(self) -> None:
        """Write the file."""
        rng, columns = self.rng, self.columns
        if rng.random() < 0.6:
            columns = [columns[place] for place in rng.permutation(len(columns))]
        times, time_name = time_cells(self.at, self.names, rng)
        separator = str(rng.choice([";", "\t"] if self.comma else [",", ",", ";", "\t"]))
        lines = []
        if rng.random() < 0.35:
            preamble = [f"Logger export of vessel {rng.integers(100)}", f"Version: {rng.uniform(1, 5):.1f}", ""]
            lines += preamble[: rng.integers(1, 4)]
        lines.append(separator.join([*time_name, *(label for label, *_ in columns)]))
        if self.where == "row":
            lines.append(separator.join([*[""] * len(time_name), *(unit for _, unit, _ in columns)]))
        for k, time in enumerate(times):
            cells = [column[2][k] for column in columns]
            lines.append(
                separator.join([*time, *([cell.replace(".", ",") for cell in cells] if self.comma else cells)])
            )
        encoding = str(rng.choice(["utf-8", "utf-8-sig", "cp1252", "utf-16"], p=[0.5, 0.2, 0.25, 0.05]))
        end = "\r\n" if rng.random() < 0.4 else "\n"
        text = end.join(lines) + end
        try:
            self.out.path.write_bytes(text.encode(encoding))
        except UnicodeEncodeError:  # letters that Windows-1252 does not have
            self.out.path.write_bytes(text.encode("utf-8"))


def cells_of(values: np.ndarray, digits: int) -> list[str]:
    """Cells of a column; empty where there is no value."""
    return [f"{value:.{digits}f}" if math.isfinite(value) else "" for value in values]


def time_cells(
    at: np.ndarray, names: dict[str, tuple[str, ...]], rng: np.random.Generator
) -> tuple[list[list[str]], list[str]]:
    """Cells of the time of each row, and the names of their columns."""
    begin = datetime(2024, 5, 17, 22, 40, 11, tzinfo=UTC) + timedelta(days=float(rng.uniform(0, 400)))
    form = str(rng.choice(["iso", "iso offset", "epoch", "ms", "two", "relative", "point"]))
    name = str(rng.choice(names["time"]))
    moments = [begin + timedelta(seconds=float(value)) for value in at]
    if form == "iso":
        return [[m.isoformat(timespec="milliseconds").replace("+00:00", "Z")] for m in moments], [name]
    if form == "iso offset":
        zone = timezone(timedelta(hours=int(rng.integers(-5, 9))))
        return [[m.astimezone(zone).isoformat(timespec="milliseconds")] for m in moments], [name]
    if form == "epoch":
        return [[f"{m.timestamp():.2f}"] for m in moments], [name]
    if form == "ms":
        return [[f"{m.timestamp() * 1000:.0f}"] for m in moments], [name]
    if form == "two":
        return [[m.strftime("%Y-%m-%d"), m.strftime("%H:%M:%S.%f")[:-4]] for m in moments], ["Date", name]
    if form == "point":
        return [[m.strftime("%d.%m.%Y %H:%M:%S.%f")[:-4]] for m in moments], [name]
    return [[f"{value:.2f}"] for value in at], [name if rng.random() < 0.5 else "t [s]"]


# Other formats ------------------------------------------------------------------------------------------------------

BEGIN = 1_715_900_000.0
"""2024-05-16T22:53:20Z."""


def write_bag(made: Made, path: Path, rng: np.random.Generator) -> Written:
    """A ROS 1 bag; REP 103."""
    from rosbags.rosbag1 import Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC)
    types = store.types
    vector, quaternion = types["geometry_msgs/msg/Vector3"], types["geometry_msgs/msg/Quaternion"]
    header_type, stamp_type = types["std_msgs/msg/Header"], types["builtin_interfaces/msg/Time"]
    out = Written(path, {"latitude": "", "longitude": "", "heading": ""}, style="ROS bag")
    root = str(rng.choice(["/ship", "/vessel", "/boat", "", "/asv"]))
    at = np.arange(0, made.time[-1], 0.2)
    m = {name: measured(made, name, at, rng) for name in made.truth}
    numbers = topics_of_numbers(made.kind, m, rng)
    imu, velocity = rng.random() < 0.75, rng.random() < 0.6
    if not imu:
        numbers.append(
            (str(rng.choice(["gps_compass/true_heading", "heading", "gyro/heading_deg"])), "", np.degrees(m["heading"]))
        )
    out.columns |= dict.fromkeys([name for _, name, _ in numbers if name] + ["yaw_rate"] * imu, "")
    out.columns |= dict.fromkeys(["sog", "cog"] if velocity else [], "")
    with Writer(path) as writer:

        def topic(names: tuple[str, ...], kind: str) -> object:
            return writer.add_connection(f"{root}/{rng.choice(names)}", kind, typestore=store)

        fix = topic(("gps/fix", "fix", "navsat/fix"), "sensor_msgs/msg/NavSatFix")
        attitude = topic(("imu/data", "imu", "xsens/imu"), "sensor_msgs/msg/Imu") if imu else None
        speed = topic(("gps/vel", "fix_velocity", "gnss/velocity"), "geometry_msgs/msg/TwistStamped")
        floats = [(topic((name,), "std_msgs/msg/Float64"), values) for name, _, values in numbers]
        zeros = np.zeros(9)
        for k in range(len(at)):
            stamp = BEGIN + at[k]
            header = header_type(k, stamp_type(int(stamp), int(stamp % 1 * 1e9)), "base_link")

            def say(connection: object, kind: str, *parts: object, nanoseconds: int = int(stamp * 1e9)) -> None:
                message = store.serialize_ros1(types[kind](*parts), connection.msgtype)
                writer.write(connection, nanoseconds, message)

            status = types["sensor_msgs/msg/NavSatStatus"](0, 1)
            say(fix, "sensor_msgs/msg/NavSatFix", header, status, m["latitude"][k], m["longitude"][k], 0.0, zeros, 0)
            if attitude:
                yaw = math.pi / 2 - m["heading"][k]
                turned = quaternion(0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2))
                rate, gravity = vector(0.0, 0.0, -m["yaw_rate"][k]), vector(0.0, 0.0, 9.81)
                say(attitude, "sensor_msgs/msg/Imu", header, turned, zeros, rate, zeros, gravity, zeros)
            if velocity:
                flow = m["sog"][k] * np.exp(1j * m["cog"][k])
                twist = types["geometry_msgs/msg/Twist"](vector(flow.imag, flow.real, 0.0), vector(0.0, 0.0, 0.0))
                say(speed, "geometry_msgs/msg/TwistStamped", header, twist)
            for connection, values in floats:
                say(connection, "std_msgs/msg/Float64", float(values[k]))
    return out


def topics_of_numbers(
    kind: str, m: dict[str, np.ndarray], rng: np.random.Generator
) -> list[tuple[str, str, np.ndarray]]:
    """Topics of a single number each: name, quantity, values; revolutions in rpm, a rudder positive to either side."""
    port, both, rpm = -1 if rng.random() < 0.4 else 1, rng.random() < 0.5, 30 / math.pi
    numbers = [("battery/voltage", "", 24 + 0.2 * rng.normal(size=len(m["heading"])))]
    if kind == "ship":
        word = str(rng.choice(["rudder", "steering", "helm"]))
        angle, order = str(rng.choice(["angle", "position", "state"])), str(rng.choice(["command", "cmd", "setpoint"]))
        numbers.append((f"{word}/{angle}", "rudder_angle", port * m["rudder_angle"]))
        if both:
            numbers.append((f"{word}/{order}", "rudder_order", port * m["rudder_order"]))
        numbers.append((str(rng.choice(["shaft/rpm", "propeller/rpm", "engine_rpm"])), "rpm", m["rpm"] * rpm))
        return numbers
    sides = [("left", "right"), ("port", "stbd"), ("port", "starboard")][rng.integers(3)]
    word, order = str(rng.choice(["thrusters", "motors", "thruster"])), str(rng.choice(["cmd", "thrust", "command"]))
    for side, name in zip(sides, ("port", "starboard"), strict=True):
        numbers.append((f"{word}/{side}/{order}", f"thrust_order_{name}", m[f"thrust_order_{name}"]))
        if both:
            numbers.append((f"{word}/{side}/rpm", f"rpm_{name}", m[f"rpm_{name}"] * rpm))
    return numbers


def write_nmea(made: Made, path: Path, rng: np.random.Generator) -> Written:
    """Sentences of NMEA 0183."""
    out = Written(path, {"latitude": "", "longitude": "", "heading": ""}, style="NMEA 0183")
    at = np.arange(0, made.time[-1], 1.0)
    m = {name: measured(made, name, at, rng) for name in made.truth}
    gps = str(rng.choice(["GP", "GN"]))
    gyro = str(rng.choice(["HE", "GP", "IN"]))
    magnetic_too, thirdly = rng.random() < 0.5, rng.random() < 0.5
    speed = str(rng.choice(["RMC", "RMC and VTG"]))
    rate, water, wind = rng.random() < 0.7, rng.random() < 0.6, rng.random() < 0.5
    lines: list[str] = []

    def say(body: str) -> None:
        check = 0
        for letter in body:
            check = xor(check, ord(letter))
        lines.append(f"${body}*{check:02X}")

    def angle(value: float, digits: int, letters: str) -> str:
        whole = int(abs(value))
        return f"{whole:0{digits}d}{(abs(value) - whole) * 60:08.5f},{letters[int(value < 0)]}"

    for k in range(len(at)):
        utc = datetime.fromtimestamp(BEGIN + at[k], UTC)
        position = f"{angle(m['latitude'][k], 2, 'NS')},{angle((m['longitude'][k] + 180) % 360 - 180, 3, 'EW')}"
        course, knots = math.degrees(m["cog"][k]), max(m["sog"][k], 0) / KNOT
        say(f"{gps}RMC,{utc:%H%M%S}.00,A,{position},{knots:.2f},{course:.1f},{utc:%d%m%y},,,A")
        if "VTG" in speed:
            say(f"{gps}VTG,{course:.1f},T,,M,{knots:.2f},N,{knots * 1.852:.2f},K,A")
        true = math.degrees(m["heading"][k])
        say(f"{gyro}{'THS' if thirdly else 'HDT'},{true:.2f},{'A' if thirdly else 'T'}")
        if magnetic_too:
            say(f"HCHDG,{(true - 4.5) % 360:.1f},,,3.0,E")
        if rate:
            say(f"{gyro}ROT,{math.degrees(m['yaw_rate'][k]) * 60:.1f},A")
        if water:
            say(f"VWVHW,,T,,M,{m['u_water'][k] / KNOT:.2f},N,,K")
        if wind:
            say(f"WIMWV,{math.degrees(m['wind_rel_direction'][k]):.0f},R,{m['wind_rel_speed'][k]:.1f},M,A")
        if made.kind == "ship":
            say(f"AGRSA,{math.degrees(m['rudder_angle'][k]):.1f},A,,V")
            say(f"IIRPM,S,0,{m['rpm'][k] * 30 / math.pi:.1f},,A")
        else:
            say(f"IIRPM,E,2,{m['rpm_port'][k] * 30 / math.pi:.0f},,A")
            say(f"IIRPM,E,1,{m['rpm_starboard'][k] * 30 / math.pi:.0f},,A")
    path.write_text("\n".join(lines) + "\n", encoding="ascii")
    names = ["sog", "cog"] + ["yaw_rate"] * rate + ["u_water"] * water
    names += ["wind_rel_speed", "wind_rel_direction"] * wind
    names += ["rudder_angle", "rpm"] if made.kind == "ship" else ["rpm_port", "rpm_starboard"]
    out.columns |= dict.fromkeys(names, "")
    return out


def write_dataflash(made: Made, path: Path, rng: np.random.Generator) -> Written:
    """ArduPilot's dataflash log as text, with orders on outputs of any number, known by parameters or not."""
    out = Written(path, {"latitude": "", "longitude": "", "heading": "", "sog": "", "cog": ""}, style="ArduPilot")
    at = np.arange(0, made.time[-1], 0.2)
    m = {name: measured(made, name, at, rng) for name in made.truth}
    outputs = rng.permutation(4) + 1
    known = rng.random() < 0.7
    functions = {26: "rudder_order"} if made.kind == "ship" else {73: "thrust_order_port", 74: "thrust_order_starboard"}
    lines = [
        "FMT, 128, 89, FMT, BBnNZ, Type,Length,Name,Format,Columns",
        "FMT, 130, 50, GPS, QBBIHBcLLeffffB, TimeUS,I,Status,GMS,GWk,NSats,HDop,Lat,Lng,Alt,Spd,GCrs,VZ,Yaw,U",
        "FMT, 131, 20, ATT, Qffffff, TimeUS,DesRoll,Roll,DesPitch,Pitch,DesYaw,Yaw",
        "FMT, 135, 20, IMU, QBffffff, TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ",
        "FMT, 133, 20, PARM, QNff, TimeUS,Name,Value,Default",
        "FMT, 134, 20, RCOU, QHHHH, TimeUS,C1,C2,C3,C4",
    ]
    pulses = {number: np.full(len(at), 1500 if number == outputs[3] else 0) for number in outputs}
    for (function, name), number in zip(functions.items(), outputs, strict=False):
        reverse = bool(known and rng.random() < 0.4)
        share = m[name] / math.radians(35) if name == "rudder_order" else m[name]
        pulses[number] = np.round(1500 + (-1 if reverse else 1) * 400 * share)
        values = {"FUNCTION": function, "MIN": 1100, "TRIM": 1500, "MAX": 1900, "REVERSED": int(reverse)}
        lines += [f"PARM, 1000, SERVO{number}_{key}, {value}, 0" for key, value in values.items()] if known else []
        out.columns[name] = ""
    rated = rng.random() < 0.7
    week = int((BEGIN + 18 - 315964800) // 604800)
    second = BEGIN + 18 - 315964800 - 604800 * week
    for k in range(len(at)):
        us = int((at[k] + 33.3) * 1e6)
        ms = round((second + at[k]) * 1000)
        position = f"{m['latitude'][k]:.7f}, {(m['longitude'][k] + 180) % 360 - 180:.7f}"
        speed = f"{m['sog'][k]:.3f}, {math.degrees(m['cog'][k]):.2f}"
        lines.append(f"GPS, {us}, 0, 3, {ms}, {week}, 12, 0.8, {position}, 1, {speed}, 0, 0, 1")
        lines.append(f"ATT, {us}, 0, {math.degrees(m['heel'][k]):.2f}, 0, 0, 0, {math.degrees(m['heading'][k]):.2f}")
        if rated:
            lines.append(f"IMU, {us}, 0, 0.001, -0.002, {m['yaw_rate'][k] + 0.001:.5f}, 0.01, 0.02, -9.8")
        lines.append(f"RCOU, {us}, " + ", ".join(f"{pulses[number][k]:.0f}" for number in sorted(pulses)))
    path.write_text("\n".join(lines) + "\n", encoding="ascii")
    out.columns |= {"yaw_rate": ""} if rated else {}
    out.columns["heel"] = ""
    return out


def write_ulog(made: Made, path: Path, rng: np.random.Generator) -> Written:
    """PX4's ULog (docs.px4.io, "ULog File Format")."""
    out = Written(
        path, {"latitude": "", "longitude": "", "heading": "", "sog": "", "cog": "", "yaw_rate": ""}, style="PX4"
    )
    at = np.arange(0, made.time[-1], 0.2)
    m = {name: measured(made, name, at, rng) for name in made.truth}
    quaternion = [np.cos(m["heading"] / 2), 0 * at, 0 * at, np.sin(m["heading"] / 2)]
    velocity = m["sog"] * np.exp(1j * m["cog"])
    topics = {
        "sensor_gps": (
            "uint64_t time_utc_usec;double latitude_deg;double longitude_deg;float vel_m_s;float cog_rad;"
            "float vel_n_m_s;float vel_e_m_s;uint8_t fix_type",
            "QddffffB",
            [np.round((BEGIN + at) * 1e6).astype(np.int64), m["latitude"], (m["longitude"] + 180) % 360 - 180,
             m["sog"], m["cog"], velocity.real, velocity.imag, np.full(len(at), 3)],
        ),
        "vehicle_attitude": ("float[4] q", "ffff", quaternion),
        "vehicle_angular_velocity": ("float[3] xyz", "fff", [0 * at, 0 * at, m["yaw_rate"] + 0.001]),
    }  # fmt: skip
    parameters = {}
    if made.kind == "ship":
        topics["actuator_servos"] = ("float[2] control", "ff", [m["rudder_order"] / math.radians(35), at * np.nan])
        topics["actuator_motors"] = ("float[2] control", "ff", [m["rpm"] / m["rpm"].max(), at * np.nan])
        topics["rpm"] = ("float rpm_estimate", "f", [m["rpm"] * 30 / math.pi])
        out.columns |= {"rudder_order": "", "rpm": "", "rpm_order": ""}
        made.truth["rpm_order"] = made.truth["rpm"]
    else:
        order = [m["thrust_order_starboard"], m["thrust_order_port"]]  # PX4 numbers the right one first
        if rng.random() < 0.5:
            parameters["CA_AIRFRAME"] = 6
        elif rng.random() < 0.5:
            order.reverse()
        topics["actuator_motors"] = ("float[2] control", "ff", order)
        out.columns |= {"thrust_order_port": "", "thrust_order_starboard": ""}
    data = bytearray(b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 0))

    def message(kind: str, body: bytes) -> None:
        data.extend(struct.pack("<HB", len(body), ord(kind)) + body)

    message("B", bytes(40))
    for name, value in parameters.items():
        key = f"int32_t {name}".encode()
        message("P", bytes([len(key)]) + key + struct.pack("<i", value))
    for name, (fields, _, _) in topics.items():
        message("F", f"{name}:uint64_t timestamp;{fields};".encode())
    for number, name in enumerate(topics):
        message("A", struct.pack("<BH", 0, number) + name.encode())
    for k in range(len(at)):
        for number, (_, letters, columns) in enumerate(topics.values()):
            us = int((at[k] + 21.0) * 1e6)
            message("D", struct.pack(f"<HQ{letters}", number, us, *(column[k] for column in columns)))
    path.write_bytes(bytes(data))
    return out


OTHERS = {"bag": write_bag, "nmea": write_nmea, "log": write_dataflash, "ulg": write_ulog}


def written(seed: int, folder: Path, vocabulary: dict[str, dict[str, tuple[str, ...]]]) -> tuple[Made, Written]:
    """The voyage of a seed and its log."""
    rng = np.random.default_rng(seed)
    made = (ship if rng.random() < 0.6 else craft)(rng)
    if seed % 4 or vocabulary is not NAMES:
        return made, write_csv(made, folder / f"{seed}.csv", rng, vocabulary)
    ending = list(OTHERS)[seed // 4 % 4]
    return made, OTHERS[ending](made, folder / f"{seed}.{ending}", rng)


# Score --------------------------------------------------------------------------------------------------------------


def is_right(made: Made, name: str, time: np.ndarray, values: np.ndarray) -> bool:
    """Whether a series in SI is that of the truth, to the noise and a delay."""
    t = time - time[0]
    truth = {"x": made.x, "y": made.y}.get(name, made.truth.get(name, np.full(len(made.time), np.nan)))
    if name in ANGLES:
        truth = np.unwrap(truth)
    error = values - np.interp(t, made.time, truth)
    if name in ("x", "y", "yaw_rate"):  # of another origin, of a gyro with a bias
        error -= np.median(error)
    if name in ANGLES:
        error = np.angle(np.exp(1j * error))
        return float(np.median(np.abs(error))) < 0.1
    size = max(float(np.std(truth)), 0.3 * float(np.sqrt(np.mean(truth**2))))
    return float(np.median(np.abs(error))) < 0.2 * size + 2 * NOISE.get(name, 0.0)


@dataclass
class Score:
    """Verdicts of one log: quantity to right, undecided, doubted (wrong below 0.9) or wrong (at 0.9 and above)."""

    style: str
    verdicts: dict[str, str]
    said: dict[str, str]


def scored(seed: int, folder: Path, vocabulary: dict[str, dict[str, tuple[str, ...]]]) -> Score:
    """Write, read and judge the voyage of a seed."""
    made, log = written(seed, folder, vocabulary)
    try:
        voyage = t2s.log(log.path).voyage
    except InputError as refusal:
        missing = {name: "undecided" for name in log.columns if name not in log.unknowable}
        return Score(log.style, missing, {name: str(refusal) for name in missing})
    verdicts, said = {}, {}
    used = {channel.quantity: channel for channel in voyage.channels.channels if channel.use}
    unasked = {"heel"} - set(log.columns)  # an attitude without roll holds one
    for name in sorted(
        {*log.columns, *used} - {"a_x", "a_y", "magnetic_heading", "v_north", "v_east", "ignore"} - unasked
    ):
        channel = used.get(name)
        series = voyage.series.get({"latitude": "x", "longitude": "y"}.get(name, name))
        if name in log.columns and series is not None and (channel is not None or name in ("sog", "cog")):
            key = {"latitude": "x", "longitude": "y"}.get(name, name)
            good = is_right(made, key, series.time_s, series.values)
            column = log.columns[name]
            good = good and (not column or channel is None or column in channel.stream)
        elif name in log.columns:
            if name not in log.unknowable:
                verdicts[name] = "undecided"
                said[name] = (
                    "; ".join(
                        f"{c.quantity} {c.confidence} {c.why}"
                        for c in voyage.channels.channels
                        if log.columns[name] and c.stream == log.columns[name]
                    )
                    or f"column {log.columns[name]!r} not taken"
                )
            continue
        else:
            good = False
        sure = channel is None or channel.confidence >= SURE
        verdicts[name] = "right" if good else "wrong" if sure else "doubted"
        if not good and channel is not None:
            found = f"{channel.unit} {channel.sign} {channel.confidence}: {channel.why}"
            said[name] = f"{channel.stream!r} for {log.columns.get(name)!r}: {found}"
    return Score(log.style, verdicts, said)


def main() -> None:
    """Print the score of a number of voyages."""
    words = [word for word in sys.argv[1:] if not word.startswith("-")]
    number = int(words[0]) if words else 80
    first = int(words[1]) if len(words) > 1 else 1
    total: Counter[str] = Counter()
    styles: dict[str, Counter[str]] = {}
    whole = clean = 0
    for seed in range(first, first + number):
        with tempfile.TemporaryDirectory() as name:
            score = scored(seed, Path(name), UNKNOWN if "--unknown" in sys.argv else NAMES)
        count = Counter(score.verdicts.values())
        total += count
        styles.setdefault(score.style, Counter()).update(count)
        whole += set(count) <= {"right"}
        clean += "wrong" not in count
        if "-v" in sys.argv:
            for quantity, text in score.said.items():
                print(seed, score.style, score.verdicts[quantity], quantity, text, flush=True)
    every = sum(total.values())
    print(f"{number} voyages from seed {first}, {every} channels:")
    for verdict, meaning in (
        ("right", "right"),
        ("undecided", "undecided"),
        ("doubted", "wrong with a confidence below 0.9"),
        ("wrong", "wrong with 0.9 or more"),
    ):
        print(f"  {meaning}: {total[verdict]} ({100 * total[verdict] / every:.1f} %)")
    print(f"  voyages with all channels right: {whole}; without one wrong with 0.9 or more: {clean}")
    for style, count in sorted(styles.items()):
        print(f"  {style}: {count['right']} of {sum(count.values())} right, {count['wrong'] + count['doubted']} wrong")


if __name__ == "__main__":
    main()
