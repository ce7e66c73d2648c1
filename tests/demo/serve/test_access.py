"""Who is let in: our own page on our own name, and nobody else's."""

import socket

import pytest

from demo.serve import access


@pytest.mark.parametrize(
    "host", ["127.0.0.1:8321", "localhost:9000", "[::1]:8321", "192.168.0.7", socket.gethostname()]
)
def test_addresses_and_own_names_are_this_machine(host):
    assert access.is_own_host(host, "127.0.0.1")


@pytest.mark.parametrize(
    "host", [None, "", "evil.example:8321", "localhost.evil.example", "127.0.0.1.evil.example", "[::"]
)
def test_names_of_others_that_lead_here_are_not(host):
    assert not access.is_own_host(host, "127.0.0.1")
    assert access.is_own_host("walk.example:80", "walk.example"), "unless it was told to serve that name"


def test_only_a_page_from_here_talks_to_the_server():
    for host in ("127.0.0.1:8321", "localhost:9000", "[::1]:8321"):
        assert access.is_own_origin(f"http://{host}", host) and access.is_own_origin(f"https://{host}", host)
    assert access.is_own_origin(None, "127.0.0.1:8321"), "a program that is no browser"
    for other in ("http://evil.example", "http://127.0.0.1:1", "null", "", "file://127.0.0.1:8321", "http://[::"):
        assert not access.is_own_origin(other, "127.0.0.1:8321")


def test_loopback_is_told():
    assert all(map(access.is_loopback, ("127.0.0.1", "127.1.2.3", "::1", "localhost")))
    assert not any(map(access.is_loopback, ("0.0.0.0", "::", "192.168.0.7", "walk.example")))
