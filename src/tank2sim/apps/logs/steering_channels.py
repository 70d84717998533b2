"""Channels of rudders and thrusters, by the turn that follows them, and of all quantities that nothing tests."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from tank2sim.apps.logs.candidates import REFUTED, STATED, ChannelSearch, Judgement
from tank2sim.apps.logs.channels import SURE_FROM, USED_FROM, LogChannel
from tank2sim.apps.logs.clock import utc_text
from tank2sim.apps.logs.content import (
    AGREES,
    DIFFERS,
    FEW_SAMPLES,
    UNIT_SLACK,
    UNTESTED,
    ContentEvidence,
    steering_evidence,
)
from tank2sim.apps.logs.quantities import (
    QUANTITIES,
    names_another,
    names_thrust,
    plain_words,
    sign_of_name,
    unit_by_size,
)
from tank2sim.apps.logs.reference import LEAST_SPEED_MPS, interpolated
from tank2sim.apps.logs.streams import LogStream
from tank2sim.arrays import Array
from tank2sim.records.trials import usual_step

FULL_RUDDER_DEG = 35.0
"""Rudder angle at full order where a log has shares alone: 35 deg on either side (SOLAS II-1, regulation 29.3.1)."""

LARGEST_LOGGED_RUDDER_RAD = math.radians(75.0)
"""Angle that no rudder goes beyond: Schilling rudders go to 70 or 75 deg."""

ALONE_LESS = 0.1
"""A pair of orders is one of thrusters if either alone agrees with the turn by so much less than their difference
(project choice)."""

_HOLDS, _MOVES = 0.5, 0.2
"""Share of samples equal to the one before of a stream that holds its values, as an order does, and of one that moves
(project choice)."""

_CLEARLY, _CLEARLY_REVERSED = 0.05, 0.2
"""By how much a rudder agrees better with the turn than all other streams, and of the speed with the
difference of two orders above that with their sum, where one controller is reversed (project choices)."""

_LITTLE, _TURNED_RAD = 0.4, math.pi / 2
"""Size of the sum of two orders over their difference's, and change of heading, rad, below which a vessel goes
straight although its orders are opposite (project choice)."""

_DOUBTED = 0.85  # Largest confidence of a stream with one open question: whether it is measured or ordered, or its unit

_ASTERN_SHARE, _ASTERN_S = 0.15, 8.0
"""Shares of the usual speed and of the usual revolutions, and a time, s, from which a vessel goes astern against them.
Project choice: beyond what a current or a coasting propeller does."""

_FASTEST_SHAFT_HZ = 100.0
"""Revolutions beyond which a record without a unit is in rpm, 1/s: small thrusters reach 80 (project choice)."""

_LEAST_ZERO, _LEAST_ZERO_SHARE = 10.0, 0.4
"""Rudder on straight legs, deg or %, from which a zero of the record is taken out, and the same of a rudder of unknown
unit, as a share of its range. Project choice: wind and a single propeller ask for some degrees (SNAME, PNA vol. III,
IX.17); servos rest at 90 deg, sensors amid their range; a rudder hardly crosses such a zero."""

_LEAST_HELM = 4.0
"""Rudder on straight legs, deg, that is doubted. Project choice: from here on a held rudder is taken to turn."""

_SHOWN = 0.6
"""Agreement of a rudder with the turn from which its sign and zero are shown. Project choice: waves and currents turn
a ship too."""

_LEAST_LEAD_S = 1.0  # Least lag of the turn behind a rudder without a name, s (project choice: a rate has none)

_SERVO_DEG = 90.0  # Servos rest at 90 deg of 180, or at 180 of 360

_STRAIGHT_S, _STRAIGHT_SHARE, _LEAST_STRAIGHT = 10.0, 0.1, 0.02
"""Time before and after for which a straight leg has been one, s, rate of turn there as a share of its 99th percentile,
and share of a log that must be such legs (project choice: rudders cross their zero faster)."""

_PAIRS = (("thrust_order_port", "thrust_order_starboard"), ("rpm_port", "rpm_starboard"))


def find_steering(search: ChannelSearch) -> None:
    """Find thrusters and rudders, and take the other streams by their names."""
    _find_unnamed_thrusters(search)
    _find_held_rudder(search)
    for stream in search.named("rudder_angle", "rudder_order", "port_rudder_angle"):
        _judge_rudder(search, stream)
    _refuse_exchanged_rudders(search)
    if not search.named("rudder_angle", "rudder_order", "thrust_order_port", "rpm_port"):
        _find_unnamed_rudder(search)
    _scale_rudder_shares(search)
    for names in _PAIRS:
        ports, starboards = (search.named(name) for name in names)
        for port, starboard in zip(ports, starboards, strict=False):
            _judge_pair(search, names, (port, starboard))
        for stream in ports[len(starboards) :] + starboards[len(ports) :]:
            search.add(Judgement(stream, 0.6, "the other side is missing", _unit(stream, stream.quantity)))
    _take_others(search)
    _scale_engine_shares(search)
    _report_lost_signs(search)


def _evidence(search: ChannelSearch, time: Array, values: Array) -> ContentEvidence:
    return steering_evidence(time, values, *search.rate)


def _held_share(stream: LogStream) -> float:
    return float((np.diff(stream.values) == 0).mean())


# Rudders --------------------------------------------------------------------------------------------------------


def _find_held_rudder(search: ChannelSearch) -> None:
    """If several streams are a rudder by their names, the one that holds its values is the order."""
    angles = search.named("rudder_angle")
    held = [stream for stream in angles if stream.stated_by == "name" and _held_share(stream) > _HOLDS]
    if not search.named("rudder_order") and len(held) == 1 and any(_held_share(other) < _MOVES for other in angles):
        search.rename(held[0], "rudder_order")


def _refuse_exchanged_rudders(search: ChannelSearch) -> None:
    """Refuse an angle that stays at its values and an order that never does: an order holds until the next."""
    angle, order = search.best("rudder_angle"), search.best("rudder_order")
    if angle is None or order is None:
        return
    held = [_held_share(search.stream(channel.stream)) for channel in (angle, order)]
    if held[0] > _HOLDS and held[1] < _MOVES:
        search.fault(angle.stream, f"holds its values as an order does, and {order.stream} does not")
        search.doubt("order and angle seem exchanged", angle.stream, order.stream)


def _zero(search: ChannelSearch, stream: LogStream, evidence: ContentEvidence) -> float:
    """Rudder reading on straight legs (slow turn, also a time before); 0 if that is near its zero or unknown."""
    time, rate = search.rate
    if stream.unit == "1" or not len(rate) or evidence.known < _SHOWN:
        return 0.0
    values = interpolated(time, stream.time_s, stream.values, 10.0)
    small = np.abs(rate) < _STRAIGHT_SHARE * float(np.percentile(np.abs(rate), 99))
    reach = max(1, round(_STRAIGHT_S / usual_step(time)))
    straight = (np.convolve(small, np.ones(2 * reach + 1), "same") > 2 * reach) & np.isfinite(values)
    if straight.sum() < max(FEW_SAMPLES, _LEAST_STRAIGHT * len(time)):
        return 0.0
    zero, span = float(np.median(values[straight])), float(np.nanmax(values) - np.nanmin(values))
    size = abs(zero) * math.degrees(QUANTITIES["rudder_angle"].units.get(stream.unit or "deg", 1.0))
    if size >= _LEAST_ZERO if stream.unit else abs(zero) > _LEAST_ZERO_SHARE * span:
        words = f"is at {zero:.4g} {stream.unit}".strip() + " on straight legs"
        search.note(stream.name, f"{words}, which is taken as its zero (offset in channels.toml)", zero=zero)
        return zero
    if size > _LEAST_HELM:
        text = f"at {zero:.3g} {stream.unit or 'deg'} on straight legs: helm against wind, or its zero"
        search.fault(stream.name, text)
    return 0.0


def _judge_rudder(search: ChannelSearch, stream: LogStream) -> None:
    time, values = search.thin(stream)
    evidence = _evidence(search, time, values * search.way_at(time))  # astern, a rudder turns the bow the other way
    zero = _zero(search, stream, evidence)
    found = search.judged(stream, evidence, agrees=_SHOWN)
    found.unit, found.offset = stream.unit or unit_by_size("rudder_angle", stream.values - zero), zero
    stated, shown = sign_of_name(stream.name), evidence.known >= _SHOWN
    if stated:
        found.sign = stated
        if shown and evidence.sign != stated:
            found.refuse(f"{found.why}: the turn contradicts the sign in its name")
    elif shown and evidence.sign < 0:
        found.turn(0.9, "it is positive to port, against its format")
        if found.sign < 0:
            search.note(stream.name, "is positive to port")
    if found.confidence < DIFFERS:
        search.fault(stream.name, found.why)
    _doubt_rudder(found, zero)
    search.add(found)


def _doubt_rudder(found: Judgement, zero: float) -> None:
    """Lower the confidence in a rudder whose kind, unit, size or zero is uncertain."""
    stream, unit_stated = found.stream, bool(found.stream.unit)
    if not unit_stated and (stream.quantity, found.unit) == ("rudder_order", "deg"):
        found.doubt(_DOUBTED, "; deg by its size, and it may be in %")
    if (stream.quantity, stream.stated_by) == ("rudder_angle", "name") and _held_share(stream) > _HOLDS:
        found.doubt(_DOUBTED, "; it holds its values as an order does")
    factor = {unit: QUANTITIES["rudder_angle"].units[unit] for unit in ("deg", "rad")}.get(found.unit, 0.0)
    most = factor * float(np.nanpercentile(np.abs(stream.values - zero), 99.9))
    if most > LARGEST_LOGGED_RUDDER_RAD:
        found.doubt(0.6, f"; it goes to {math.degrees(most):.3g} deg, as no rudder does")
    if zero:
        if not unit_stated and abs(zero / _SERVO_DEG - round(zero / _SERVO_DEG)) > 0.01:
            found.doubt(0.6, "; its unit is known by its size alone")
        found.doubt(STATED["name"], f"; {zero:.4g} on straight legs is taken as its zero")


def _find_unnamed_rudder(search: ChannelSearch) -> None:
    """The stream without a name that leads the turn as a rudder does; none where no rate of turn is known."""
    rates = [best.confidence for name in ("yaw_rate", "heading") if (best := search.best(name)) is not None]
    leading = _leading_the_turn(search) if rates else []
    for place, (evidence, stream) in enumerate(leading):
        confidence, more = _among_rivals(leading, place, 0.75 if max(rates) > 0.8 else 0.7)
        quantity = "rudder_order" if _held_share(stream) > _HOLDS else "rudder_angle"
        search.add_unnamed(stream, quantity, confidence, evidence, more, _unit(stream, quantity))


def _among_rivals(leading: list[tuple[ContentEvidence, LogStream]], place: int, confidence: float) -> tuple[float, str]:
    """Confidence in one of the streams that lead the turn; less, and the others, where more than one rudder does."""
    (clearest, first), (_, stream) = leading[0], leading[place]
    rivals = [evidence.known for evidence, other in leading if not _alike(first, other)]
    if not rivals or (place == 0 and clearest.known > rivals[0] + _CLEARLY):
        return confidence, ""
    others = ", ".join(other.name for _, other in leading if other is not stream)
    return 0.7 if place == 0 else 0.5, f"; the same is true of {others}"


def _leading_the_turn(search: ChannelSearch) -> list[tuple[ContentEvidence, LogStream]]:
    """Streams without a name that the turn follows as it follows a rudder, the clearest first."""
    taken = {channel.stream for channel in search.found if channel.confidence >= USED_FROM}
    free = [stream for stream in search.streams if stream.name not in taken and _could_be_rudder(stream)]
    tested = [(_evidence(search, *search.thin(stream)), stream) for stream in free]
    leading = [entry for entry in tested if entry[0].known > AGREES and entry[0].lag_s >= _LEAST_LEAD_S]
    return sorted(leading, key=lambda entry: -entry[0].known)


def _could_be_rudder(stream: LogStream) -> bool:
    """Whether a stream of no known quantity moves within the angles or shares of rudders."""
    if stream.quantity or names_another(stream.name) or np.ptp(stream.values) == 0:
        return False
    return bool(_unit(stream, "rudder_angle"))


def _alike(first: LogStream, second: LogStream) -> bool:
    """Whether two streams are the order and the angle of one rudder."""
    other = np.interp(first.time_s, second.time_s, second.values)
    return abs(float(np.corrcoef(first.values, other)[0, 1])) > 0.95


def _scale_rudder_shares(search: ChannelSearch) -> None:
    """Orders in shares of the full rudder, scaled by the angle where it is known, else by the usual full rudder."""
    for place, channel in enumerate(search.found):
        angle = next((c for c in search.found if c.quantity == "rudder_angle" and c.unit in ("deg", "rad")), None)
        known = angle if angle is not None and angle.confidence >= USED_FROM else None
        search.found[place] = _in_degrees(search, _by_angle(search, channel, known), known)


def _in_degrees(search: ChannelSearch, channel: LogChannel, angle: LogChannel | None) -> LogChannel:
    """A rudder in shares of the full rudder in deg, by the `angle` that is known; any other channel as it is."""
    if channel.quantity not in ("rudder_order", "rudder_angle") or channel.unit not in ("1", "%"):
        return channel
    share = QUANTITIES["rudder_order"].units[channel.unit]
    ratio = None if angle is None else _ratio(search, angle, channel)
    if angle is not None and ratio is not None:
        full = math.degrees(ratio)
        found = channel.because(f"full order is {full:.3g} deg by {angle.stream}")
    else:
        full = FULL_RUDDER_DEG / max(1 - abs(share * channel.offset), 0.5)  # 50 of 0 to 100 % leaves 50 to a side
        text = f"full order is taken as {FULL_RUDDER_DEG:g} deg" if angle is None else ""
        found = channel.because(text, most=STATED["name"])
    return replace(found, unit="deg", scale=full * share)


def _by_angle(search: ChannelSearch, order: LogChannel, angle: LogChannel | None) -> LogChannel:
    """An order without a unit that is deg by its size: sure, or in %, by the angle that follows it; any other as is."""
    by_size = order.quantity == "rudder_order" and order.unit == "deg" and not search.stream(order.stream).unit
    ratio = _ratio(search, angle, order, least_share=0.0) if by_size and angle is not None else None
    if angle is None or ratio is None:
        return order
    if abs(ratio - 1) < UNIT_SLACK:
        return order.because(f"{angle.stream} shows deg", least=SURE_FROM)
    return replace(order, unit="%")


def _ratio(search: ChannelSearch, measured: LogChannel, order: LogChannel, least_share: float = 0.3) -> float | None:
    """Measured value (SI) over ordered share, where the order is held and not small; None where it never is."""
    time, share = search.series(order)
    value = interpolated(time, *search.series(measured), 10.0)
    good = np.isfinite(value) & (np.abs(share) > (least_share or 0.3 * np.abs(share).max()))
    if good.sum() < FEW_SAMPLES:
        return None
    ratio = value[good] / share[good]
    middle = float(np.median(ratio))
    return middle if np.median(np.abs(ratio - middle)) < 0.1 * abs(middle) and middle > 0 else None


# Thrusters ------------------------------------------------------------------------------------------------------


def _find_unnamed_thrusters(search: ChannelSearch) -> None:
    """Two streams of orders without a name whose difference turns the vessel, which neither does alone."""
    if search.named("thrust_order_port", "thrust_order_starboard", "rudder_order", "rudder_angle"):
        return
    orders = [stream for stream in search.streams if _could_be_thruster(stream)]
    if len(orders) != 2:
        return
    time, port, starboard = _pair_series(search, *orders)
    both, *alone = (_evidence(search, time, values).known for values in (port - starboard, port, starboard))
    if both > 0.6 and both > max(alone) + ALONE_LESS:
        for stream, quantity in zip(orders, _PAIRS[0], strict=True):
            search.rename(stream, quantity)


def _could_be_thruster(stream: LogStream) -> bool:
    """Whether a stream of no known quantity may be a share of the full order of a thruster."""
    share = not stream.quantity and (stream.unit == "1" or (not stream.unit and names_thrust(stream.name)))
    return bool(share and np.ptp(stream.values) > 0.1 and np.nanmax(np.abs(stream.values)) < 2)


def _pair_series(search: ChannelSearch, port: LogStream, starboard: LogStream) -> tuple[Array, Array, Array]:
    """Times and values of two orders at the times of the first."""
    time, values = search.thin(port)
    return time, values, np.interp(time, *search.thin(starboard))


def _judge_pair(search: ChannelSearch, names: tuple[str, str], pair: tuple[LogStream, LogStream]) -> None:
    """Judge two orders or revolutions: their sides by the turn, and their signs by the speed ahead."""
    way = _reversed(search, *pair)
    time, port, starboard = _pair_series(search, *pair)
    evidence = _evidence(search, time, way.signs[0] * port - way.signs[1] * starboard)
    swapped = evidence.known > _SHOWN and evidence.sign < 0
    for side, stream in enumerate(pair):
        found = search.judged(stream, evidence, agrees=_SHOWN)
        found.sign = way.signs[side]
        # A reversed controller is found by the speed, and then the turn shows the sides, or nothing.
        exchanged = swapped and (stream.stated_by == "" or way.one_reversed)
        quantity = names[1 - side if exchanged else side]
        if exchanged:
            found.confidence, found.why = 0.9, f"{evidence.text} with the sides exchanged"
        elif swapped:
            found.refuse(f"{found.why}: the turn contradicts its side")
            search.fault(stream.name, found.why)
        _judge_way(search, found, way, swapped or evidence.agreement is None or evidence.known >= _SHOWN)
        _take_share_unit(found, quantity)
        search.add(found, quantity)
        if exchanged and stream.stated_by == "name":
            search.fault(stream.name, f"is {QUANTITIES[quantity].words}, against its name: {evidence.text}")
        if found.sign < 0:
            search.fault(stream.name, f"is positive astern: {way.text}")


def _judge_way(search: ChannelSearch, found: Judgement, way: _PairSigns, sides_shown: bool) -> None:
    """Confidence of one of a pair of orders of which the speed ahead shows that one, or either, is reversed."""
    if way.one_reversed:
        found.confidence = _DOUBTED if sides_shown else STATED["name"]
        found.why += f"; {way.text}"
    elif way.text:
        found.confidence = REFUTED
        search.fault(found.stream.name, way.text)


def _take_share_unit(found: Judgement, quantity: str) -> None:
    """Unit of an order or of revolutions; rpm by their size is doubted unless the name or the size is clear."""
    stream = found.stream
    found.unit = _unit(stream, quantity)
    clear = "rpm" in plain_words(stream.name).split() or np.abs(stream.values).max() > _FASTEST_SHAFT_HZ
    if found.unit == "rpm" != stream.unit and not clear:
        found.doubt(_DOUBTED, "; rpm by their size")


def _speed_ahead(search: ChannelSearch) -> Array:
    """Speed ahead over the ground at the times of the motion (n,), m/s."""
    angle = search.heading_at(search.motion.time_s)
    return search.motion.v_north_mps * np.cos(angle) + search.motion.v_east_mps * np.sin(angle)


@dataclass(frozen=True)
class _PairSigns:
    """Signs of two orders, and what the speed ahead shows of them; 1 and 1 also if either may be reversed."""

    signs: tuple[int, int] = (1, 1)
    text: str = ""

    @property
    def one_reversed(self) -> bool:
        """Whether one of them is reversed, and which one is known."""
        return -1 in self.signs


def _reversed(search: ChannelSearch, port: LogStream, starboard: LogStream) -> _PairSigns:
    """Signs of two orders by the speed ahead, which follows their sum."""
    at, ahead = search.motion.time_s, _speed_ahead(search)
    good = np.isfinite(ahead)
    if search.best("heading") is None or good.sum() < FEW_SAMPLES or port.stated_by == "format":
        return _PairSigns()
    if np.percentile(np.abs(ahead[good]), 95) < 2 * LEAST_SPEED_MPS:
        return _PairSigns()
    time, first, second = _pair_series(search, port, starboard)
    total, difference = (
        steering_evidence(time, values, at[good], ahead[good]) for values in (first + second, first - second)
    )
    # A pair that pulls apart for long turns the vessel about, unless one of it is reversed.
    turned = np.ptp(search.heading_at(at)[good])
    straight = np.std(first + second) < _LITTLE * np.std(first - second) and turned < _TURNED_RAD
    if difference.known >= max(_SHOWN, 0.0 if straight else total.known + _CLEARLY_REVERSED):
        text = f"the speed ahead follows the difference of the orders by {difference.known:.2f}"
        return _PairSigns((difference.sign, -difference.sign), text)
    if total.known >= _SHOWN and total.sign < 0:
        return _PairSigns(text="the speed falls with the orders: one or both are reversed")
    return _PairSigns()


def _unit(stream: LogStream, quantity: str) -> str:
    """Stated unit of a stream, or its unit as a quantity by its size."""
    return stream.unit or unit_by_size(quantity, stream.values)


# The others -----------------------------------------------------------------------------------------------------


def _take_others(search: ChannelSearch) -> None:
    """Take the streams that nothing tests, by format or name, and their units by size."""
    done = {channel.stream for channel in search.found}
    for stream in search.streams:
        if stream.quantity and stream.name not in done:
            found = search.judged(stream, UNTESTED)
            found.unit = _unit(stream, stream.quantity)
            search.add(found)


def _scale_engine_shares(search: ChannelSearch) -> None:
    """Orders of the engine in shares of the full order, by the measured revolutions."""
    measured = next((c for c in search.found if c.quantity == "rpm" and c.unit), None)
    for place, channel in enumerate(search.found):
        if channel.quantity != "rpm_order" or channel.unit not in ("1", "%"):
            continue
        ratio = None if measured is None else _ratio(search, measured, channel)
        if ratio is None:
            search.found[place] = channel.because("the revolutions at full order are not known", most=0.6)
            continue
        rpm = ratio * 60 / (2 * math.pi)
        found = channel.because(f"full order is {rpm:.4g} rpm by the measured revolutions", least=SURE_FROM)
        scale = rpm * QUANTITIES["rpm_order"].units[channel.unit]
        search.found[place] = replace(found, unit="rpm", scale=scale)


def _report_lost_signs(search: ChannelSearch) -> None:
    """Report revolutions that stay ahead while the vessel goes astern; refuse the opposite."""
    heading = search.best("heading")
    if heading is None or heading.confidence < SURE_FROM:
        return
    at, ahead = search.motion.time_s, _speed_ahead(search)
    usual = float(np.percentile(search.motion.speed_mps, 95)) if len(at) else 0.0
    fast = max(_ASTERN_SHARE * usual, LEAST_SPEED_MPS)
    for stream in search.named("rpm", "rpm_port", "rpm_starboard", "rpm_order"):
        values = interpolated(at, stream.time_s, stream.values, 10.0)
        shown = values[(ahead > fast) & np.isfinite(values)]
        if len(shown) > FEW_SAMPLES and (shown < 0).mean() > AGREES:
            search.fault(stream.name, "is negative while the vessel goes ahead: its sign is the other one")
            search.doubt("the motion contradicts its sign", stream.name)
            continue
        turning = values > _ASTERN_SHARE * float(np.percentile(stream.values, 95))
        astern = (ahead < -fast) & turning & (stream.values.min() >= 0)
        if astern.sum() * usual_step(at) > _ASTERN_S:
            where = f"stays ahead while the vessel goes astern ({utc_text(at[np.argmax(astern)])})"
            remedy = "its sign is lost, or the pitch is astern; leave out the trials that go astern"
            search.fault(stream.name, f"{where}: {remedy}")
