from __future__ import annotations

import control
import numpy as np
import pytest

from tank2sim.analysis.linearisation import jacobians, state_space, straight_course
from tank2sim.analysis.stability.imo import imo_criteria
from tank2sim.analysis.stability.margin import stability_margin
from tank2sim.analysis.stability.response import steering_responses
from tank2sim.analysis.stability.straight_line import nomoto, stability, steering_modes
from tank2sim.analysis.stability.study import _about_speed
from tank2sim.cards import linear_card, parse_card, read_card
from tank2sim.dynamics import build
from tank2sim.dynamics.model import Model
from tank2sim.errors import InputError
from tank2sim.simulation.manoeuvres import Stop
from tank2sim.simulation.run import simulate
from tests.analysis.symmetric_ship import SYMMETRIC


def test_the_mariner_is_stable_with_the_criterion_computed_by_hand() -> None:
    """C' = Y_v N_r - N_v Y_r of the printed numbers, which contain the inertia terms."""
    found = stability(build(read_card("mariner", SYMMETRIC)))
    assert found.stability_criterion.C_prime == pytest.approx(1160e-5 * 166e-5 - 264e-5 * 499e-5, rel=1e-9)
    assert found.stability_criterion.stable and all(value.real < 0 for value in found.eigenvalues)


@pytest.mark.slow
def test_reading_the_printed_yaw_terms_as_bare_derivatives_makes_the_stable_mariner_unstable() -> None:
    """The trap: Y_r, N_r, X_vr, X_rr as printed already contain the inertia terms."""
    trapped = stability(build(read_card("mariner", {"model.yaw_rate_terms": "hydrodynamic"})))
    assert not trapped.stability_criterion.stable and trapped.eigenvalues[0].real > 0
    assert stability(build(read_card("mariner"))).stability_criterion.stable


def test_nomoto_of_the_mariner_is_that_of_the_literature() -> None:
    """K' = 3.86, T1' = 5.66, T2' = 0.38, T3' = 0.89 (Chislett and Strom-Tejsen, as in Fossen 1994, table 5.1)."""
    found = stability(build(read_card("mariner", SYMMETRIC))).nomoto.prime
    assert found.K_prime == pytest.approx(3.86, abs=0.01)
    assert found.T1_prime == pytest.approx(5.66, abs=0.01)
    assert found.T2_prime == pytest.approx(0.38, abs=0.01)
    assert found.T3_prime == pytest.approx(0.89, abs=0.01)


def test_nomoto_agrees_with_poles_zeros_and_gain_of_python_control(mariner) -> None:
    steering = state_space(
        mariner,
        straight_course(mariner),
        states=["motion.v", "motion.r"],
        inputs=["rudder.angle"],
        outputs=["motion.r"],
    )
    found = nomoto(steering.A, steering.B, steering.C)
    assert found.K_per_s == pytest.approx(float(control.dcgain(steering)))
    np.testing.assert_allclose(sorted(-1 / control.poles(steering).real), sorted([found.T1_s, found.T2_s]))
    np.testing.assert_allclose(-1 / control.zeros(steering).real, [found.T3_s])
    assert found.T_s == pytest.approx(found.T1_s + found.T2_s - found.T3_s)


def test_a_small_rudder_step_settles_at_nomotos_gain(mariner) -> None:
    from tank2sim.simulation.integrator import Integrator
    from tank2sim.simulation.running import Running

    point = straight_course(mariner)
    at = dict(zip(mariner.state_names, point.x, strict=True))
    small = np.radians(0.001)
    start = {"initial.v": at["motion.v"], "initial.rudder_angle": at["rudder.angle"]}
    running = Running(Integrator(mariner), {"rudder.command": at["rudder.angle"] + small}, start)
    running.run(100.0)
    found = stability(mariner).nomoto.dimensional
    rise = 1 - (found.T1_s - found.T3_s) / (found.T1_s - found.T2_s) * np.exp(-100.0 / found.T1_s)
    # the steering gear delays by its time constant of 1 s
    assert running.state("motion.r") / small == pytest.approx(found.K_per_s * rise, rel=0.02)


def test_matrices_are_the_slopes_of_the_right_hand_side(mariner) -> None:
    point = straight_course(mariner)
    system = state_space(mariner, point)
    names = mariner.state_names
    for k in range(len(names)):
        step = np.zeros(len(names))
        step[k] = 1e-6
        ahead, back = (np.array(mariner.rhs(point.x + s, point.u, point.p)).ravel() for s in (step, -step))
        np.testing.assert_allclose(system.A[:, k], (ahead - back) / 2e-6, rtol=1e-6, atol=1e-8)
    assert system.state_labels[names.index("motion.r")] == "motion_r"
    assert system.input_labels == ["rudder_command"]


def test_a_straight_course_is_straight_also_for_an_asymmetric_ship(mariner) -> None:
    point = straight_course(mariner)
    rates = dict(zip(mariner.state_names, np.array(mariner.rhs(point.x, point.u, point.p)).ravel(), strict=True))
    assert abs(rates["motion.v"]) < 1e-12 and abs(rates["motion.r"]) < 1e-14 and rates["motion.psi"] == 0.0
    assert point.u[mariner.input_names.index("rudder.command")] != 0.0


def test_linear_and_third_order_models_agree_at_the_speed_of_expansion() -> None:
    card = read_card("mariner", SYMMETRIC)
    third, first = stability(build(card)), stability(build(linear_card(card)))
    assert first.stability_criterion.C_prime == pytest.approx(third.stability_criterion.C_prime)
    np.testing.assert_allclose(first.eigenvalues, third.eigenvalues, rtol=1e-9)


def test_no_straight_course_is_reported(mariner_card) -> None:
    text = mariner_card.text.replace("Nd = -139e-5", "Nd = 0.0").replace("Nddd = 45e-5", "Nddd = 0.0")
    text = text.replace("N0 = 3e-5", "N0 = 900e-5").replace("Nvvd = -489e-5", "Nvvd = 0.0")
    with pytest.raises(InputError, match="straight course"):
        stability(build(parse_card(text, "ship.toml")))


def test_slopes_of_forces_are_the_derivatives_of_the_card() -> None:
    model = build(read_card("mariner", SYMMETRIC))
    slopes, _ = jacobians(model, straight_course(model), ["force.Y", "force.N"], ["motion.v", "motion.r"], [])
    half, L, U = 0.5 * 1025.0, 160.93, 7.7175
    expected = half * L**2 * U * np.array([[-1160e-5, -499e-5 * L], [-264e-5 * L, -166e-5 * L**2]])
    np.testing.assert_allclose(slopes, expected, rtol=1e-9)


def test_imo_limits_follow_the_resolution(mariner) -> None:
    """L/V = 20.85 s: first overshoot of a 10/10 within 5 + L/2V, second within 17.5 + 0.75 L/V."""
    limits = {one.name: one.allowed for one in imo_criteria(mariner)}
    assert limits["10/10 zigzag, first overshoot"] == pytest.approx(5 + 0.5 * 160.93 / 7.7175)
    assert limits["10/10 zigzag, second overshoot"] == pytest.approx(17.5 + 0.75 * 160.93 / 7.7175)
    assert limits["advance"] == 4.5 and limits["tactical diameter"] == 5.0


def test_imo_verdicts_of_the_mariner(mariner) -> None:
    verdicts = {one.name: one.passed for one in imo_criteria(mariner)}
    assert verdicts.pop("tactical diameter") is False  # 6.4 L to starboard: she turns wide
    assert verdicts.pop("stopping, full astern, track reach") is None  # her card has no propulsion
    assert all(verdicts.values())


def test_margins_are_what_is_left_to_the_limit(mariner) -> None:
    found = {one.name: one for one in imo_criteria(mariner)}
    advance, tactical = found["advance"], found["tactical diameter"]
    assert advance.margin == pytest.approx(4.5 - advance.found) and advance.margin_percent > 0
    assert tactical.margin_percent == pytest.approx(100 * (1 - tactical.found / 5)) and tactical.margin < 0
    stopping = found["stopping, full astern, track reach"]
    assert stopping.margin is None and "propulsion" in stopping.remark


@pytest.mark.slow
def test_the_stopping_criterion_is_the_track_reach_of_a_crash_stop() -> None:
    model = build(read_card("esso-osaka-estimated"))
    found = imo_criteria(model)
    reach = simulate(model, Stop()).figures["track_reach_lengths"]
    assert found[-1].found == pytest.approx(reach) and found[-1].allowed == 15.0
    assert found[-1].passed is None and found[-1].beyond_card  # a stop leaves the speeds of every card
    assert "100 m" in found[3].remark  # the card is that of a model of 3 m


def test_a_trial_that_cannot_be_run_leaves_its_criteria_open_with_the_reason() -> None:
    """A feeding moment throws the ship out of every bound in a hard turn."""
    criteria = imo_criteria(build(read_card("mariner", {"derivatives.Nvvr": 0.5})))
    lost = [one for one in criteria if one.found is None and "propulsion" not in one.remark]
    assert lost and all("bounds" in one.remark and one.passed is None for one in lost)


def test_a_neutral_ship_has_a_gain_without_end() -> None:
    changed = {"model.kind": "linear", "derivatives.Nv": 0.0, "derivatives.Nr": 0.0}
    found = stability(build(read_card("mariner", changed)))
    assert (
        found.stability_criterion.C_prime == 0.0
        and not found.stability_criterion.stable
        and not np.isfinite(found.nomoto.dimensional.K_per_s)
    )


def test_a_ship_whose_modes_both_grow_is_not_called_stable() -> None:
    """C' > 0 is necessary, not sufficient: with positive Y_v and N_r both modes of sway and yaw grow."""
    changed = {"model.kind": "linear", "derivatives.Nv": 0.0, "derivatives.Yv": 0.0005, "derivatives.Nr": 0.0001}
    model = build(read_card("mariner", changed))
    found, modes = stability(model), steering_modes(model, straight_course(model))
    assert found.stability_criterion.C_prime > 0 and any(mode.real > 0 for mode in modes)
    assert not found.stability_criterion.stable


@pytest.mark.slow
def test_the_imo_criteria_are_those_of_calm_water(mariner) -> None:
    effect = [{"name": "current", "parameters": {"speed_mps": 0.8, "direction_deg": 40.0}}]
    assert imo_criteria(build(read_card("mariner", {"effects": effect}))) == imo_criteria(mariner)


def test_a_flow_with_memory_changes_no_slow_motion() -> None:
    """z follows v: in slow motion v - z is nothing, and criterion, modes and Nomoto's K are those without memory."""
    card = read_card("mariner")
    effect = "\n[[effects]]\nname = 'flow_memory'\n[effects.parameters]\nshare = 0.3\ntime_constant_s = 8.0\n"
    with_memory = stability(build(parse_card(card.text + effect, "memory.toml")))
    without = stability(build(card))
    assert with_memory.stability_criterion.C_prime == pytest.approx(
        without.stability_criterion.C_prime, rel=0.02
    )  # about a slightly other course
    assert with_memory.nomoto.dimensional.K_per_s == pytest.approx(without.nomoto.dimensional.K_per_s, rel=0.02)


def test_settled_states_are_those_of_the_slow_limit() -> None:
    """With roll: the heel that the steady yaw rate holds adds its force, as the slow end of the whole system shows."""
    effect = (
        "\n[[effects]]\nname = 'roll_coupling'\n[effects.parameters]\nYphi = 1e-4\nNphi = -5e-5\nroll_period_s = 12.0\n"
    )
    model = build(parse_card(read_card("mariner", SYMMETRIC).text + effect, "roll.toml"))
    point = straight_course(model)
    motion = ["motion.v", "motion.r"]
    extra = [name for name in model.state_names if name not in {"rudder.angle", *(f"motion.{c}" for c in "uvrxy")}]
    extra.remove("motion.psi")
    small = state_space(model, point, states=motion, inputs=["rudder.angle"], outputs=["motion.r"], settled=extra)
    whole = state_space(model, point, states=[*motion, *extra], inputs=["rudder.angle"], outputs=["motion.r"])
    assert control.dcgain(small) == pytest.approx(control.dcgain(whole), rel=1e-9)
    frozen = state_space(model, point, states=motion, inputs=["rudder.angle"], outputs=["motion.r"])
    assert abs(control.dcgain(frozen) / control.dcgain(whole) - 1) > 1e-3


def with_effect(name: str, parameters: dict[str, float], changed: dict[str, object] | None = None):
    return build(read_card("mariner", {"effects": [{"name": name, "parameters": parameters}], **(changed or {})}))


@pytest.fixture(scope="module")
def rolling():
    """Slow motions decay, and the roll grows."""
    return with_effect("roll_coupling", {"Yphi": 0.001, "Nphi": 0.02})


def test_a_ship_whose_roll_grows_is_unstable_whatever_her_slow_motions_say(rolling) -> None:
    found = stability(rolling)
    point = straight_course(rolling)
    motion = [f"motion.{one}" for one in ("u", "v", "r", "phi", "p")]
    truth = np.linalg.eigvals(state_space(rolling, point, states=motion).A)
    np.testing.assert_allclose(np.sort_complex(found.eigenvalues), np.sort_complex(truth), rtol=1e-9)
    assert found.stability_criterion.growth_per_s == pytest.approx(0.0171, abs=1e-4)
    assert (
        found.stability_criterion.C_prime > 0
        and not found.stability_criterion.stable
        and not found.stability_criterion.C_prime_decides
    )
    assert found.stability_criterion.settled_states == ("motion.phi", "motion.p")


def test_the_step_of_the_whole_system_grows_with_the_roll(rolling) -> None:
    found = stability(rolling)
    hull, gear, _ = steering_responses(rolling, straight_course(rolling), found.nomoto.dimensional)
    assert (
        hull.poles.real.max() == pytest.approx(found.stability_criterion.growth_per_s, rel=1e-2)
        and len(hull.poles) == 4
    )
    assert len(gear.poles) == 5  # the gear besides
    crossings = np.diff(np.sign(np.diff(hull.step_per_s)))
    # at least eight samples from one turn of the curve to the next
    assert np.diff(np.flatnonzero(crossings)).min() >= 6
    _, second, _, last = np.array_split(np.abs(np.diff(hull.step_per_s, 2)), 4)
    assert last.max() > 2 * second.max()


def test_the_flows_memory_is_among_the_modes() -> None:
    """Eigenvalues of the matrix written by hand: v in Y_v v and N_v v is v - share (v - z), dz/dt = (v - z)/tau."""
    share, tau = 0.5, 20.0
    linear_ship = {"model.kind": "linear", **SYMMETRIC}
    ship = with_effect("flow_memory", {"share": share, "time_constant_s": tau}, linear_ship)
    found, modes = stability(ship), steering_modes(ship, straight_course(ship))
    bare = build(read_card("mariner", linear_ship))
    A = state_space(bare, straight_course(bare), states=["motion.v", "motion.r"]).A
    late = share * A[:, :1]
    whole = np.block([[A - np.hstack([late, np.zeros((2, 1))]), late], [np.array([[1 / tau, 0.0, -1 / tau]])]])
    np.testing.assert_allclose(np.sort(np.real(modes)), np.sort(np.linalg.eigvals(whole)), rtol=1e-9)
    assert found.stability_criterion.stable and found.stability_criterion.C_prime == pytest.approx(
        stability(bare).stability_criterion.C_prime
    )


def test_an_engine_that_lags_is_no_state_that_answers_to_sway_and_yaw() -> None:
    card = read_card(
        "esso-osaka-estimated", {"effects": [{"name": "engine_lag", "parameters": {"time_constant_s": 2.0}}]}
    )
    assert stability(build(card)).stability_criterion.settled_states == ()


def test_a_linear_card_is_that_of_its_own_speed_alone() -> None:
    model = build(read_card("mariner", {"model.kind": "linear", **SYMMETRIC}))
    own, other = stability(model), stability(model, 5.4)
    assert own.stability_criterion.C_prime == pytest.approx(1160e-5 * 166e-5 - 264e-5 * 499e-5, rel=1e-9)
    assert (
        other.stability_criterion.C_prime == pytest.approx(own.stability_criterion.C_prime)
        and other.nomoto.prime == own.nomoto.prime
    )
    margin = stability_margin(model, 5.4)
    assert margin.C_prime == pytest.approx(own.stability_criterion.C_prime) and margin.speed is None
    third = build(read_card("mariner", SYMMETRIC))
    assert stability(third, 5.4).stability_criterion.C_prime < 0.5 * stability(third).stability_criterion.C_prime


def test_a_ship_that_sway_does_not_push_is_reported_so() -> None:
    with pytest.raises(InputError, match="Yv and Nv"):
        stability(build(read_card("mariner", {"derivatives.Yv": 0.0, "derivatives.Nv": 0.0})))
    with pytest.raises(InputError, match="Yd and Nd"):
        stability(build(read_card("mariner", {"derivatives.Yd": 0.0, "derivatives.Nd": 0.0})))


def test_a_criterion_read_off_outside_the_range_of_the_card_is_not_passed() -> None:
    criteria = {
        one.name: one for one in imo_criteria(build(read_card("mariner", {"model.valid_speed_mps": [7.0, 9.3]})))
    }
    advance, first = criteria["advance"], criteria["initial turning, 10 deg rudder to 10 deg heading"]
    assert advance.found < advance.allowed and advance.beyond_card and advance.passed is None
    assert "7.00 to 9.30 m/s" in advance.remark
    assert first.passed and not first.beyond_card and not first.remark  # settled before the speed has fallen so far


def test_no_criterion_is_passed_by_a_card_that_was_never_measured_in_yaw() -> None:
    criteria = imo_criteria(build(read_card("kvlcc2-captive")))
    assert all(one.beyond_card and one.passed is None for one in criteria if one.found is not None)
    assert sum(one.found is not None for one in criteria) == 6


def test_a_rudder_that_turns_the_wrong_way_is_the_reason_of_what_is_not_shown() -> None:
    changed = {"derivatives.Yd": -278e-5, "derivatives.Nd": 139e-5}
    criteria = imo_criteria(build(read_card("mariner", changed)))
    assert all(one.found is None and "against its rudder" in one.remark for one in criteria[:-1])


@pytest.mark.parametrize(("speed_mps", "leads"), [(99.0, True), (7.0, False)])
def test_a_speed_outside_the_range_of_the_card_is_a_caution(mariner: Model, speed_mps: float, leads: bool) -> None:
    notices = _about_speed(mariner, stability(mariner, speed_mps), by_speed=True)
    assert any(notice.leads for notice in notices) == leads
