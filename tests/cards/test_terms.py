from hypothesis import given
from hypothesis import strategies as st

from tank2sim.cards.terms import Term, parse_term

powers = st.integers(0, 3)
terms = st.builds(Term, st.sampled_from("XYN"), powers, powers, powers, powers)


@given(terms)
def test_a_name_and_its_term_are_one(term: Term) -> None:
    assert parse_term(term.name) == term


@given(terms.filter(lambda term: term.v + term.r + term.d > 0), st.randoms())
def test_letters_are_understood_in_any_order(term: Term, random) -> None:
    letters = list(term.name[1:])
    random.shuffle(letters)
    assert parse_term(term.force + "".join(letters)) == term


def test_printed_names_are_read() -> None:
    assert parse_term("Yvvr") == Term("Y", v=2, r=1)
    assert parse_term("Xudd") == parse_term("Xddu") == Term("X", d=2, u=1)
    assert parse_term("Y0uu") == Term("Y", u=2)
    assert parse_term("N0") == Term("N")
    assert parse_term("Nrdot") == Term("N", acceleration="r")


def test_what_is_no_name_is_none() -> None:
    for text in ("", "Y", "Z0", "Yw", "yv", "Ydelta", "Y0v", "Yv ", "Kq", "Ydot", "Yddot"):
        assert parse_term(text) is None, text
