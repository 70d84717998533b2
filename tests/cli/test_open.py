"""A page is shown in the browser, and nothing else is."""

import webbrowser

import pytest

from tests.cli.command_line import refused, tank2sim


@pytest.fixture
def opened(monkeypatch):
    """Addresses that the browser was asked to show."""
    addresses = []
    monkeypatch.setattr(webbrowser, "open", lambda address: addresses.append(address) or True)
    return addresses


def test_a_page_is_opened_by_its_address(tmp_path, opened):
    page = tmp_path / "a page.html"
    page.write_text("<p>", encoding="utf-8")
    assert tank2sim("open", page.name, cwd=tmp_path).returncode == 0
    assert opened == [page.as_uri()]


@pytest.mark.parametrize("name", ["none.html", "card.toml"])
def test_what_is_not_a_page_is_refused(tmp_path, opened, name):
    (tmp_path / "card.toml").write_text("", encoding="utf-8")
    refused(tank2sim("open", name, cwd=tmp_path), name)
    assert opened == []


def test_without_a_browser_the_address_is_reported(tmp_path, monkeypatch):
    page = tmp_path / "page.html"
    page.write_text("<p>", encoding="utf-8")
    monkeypatch.setattr(webbrowser, "open", lambda address: False)
    refused(tank2sim("open", page.name, cwd=tmp_path), page.as_uri())
