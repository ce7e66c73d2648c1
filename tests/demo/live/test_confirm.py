"""What loses something of the user's is asked for twice."""

from types import SimpleNamespace

from demo.live.confirm import SECONDS, confirmed


def test_only_the_same_thing_asked_again_in_time_is_confirmed():
    said: list[str] = []
    now = [100.0]
    live = SimpleNamespace(asked=("", 0.0), clock=lambda: now[0], say=lambda text, colour: said.append(text))
    assert not confirmed(live, "remove limp", "limp goes") and said == ["limp goes"]
    assert not confirmed(live, "remove hero", "hero goes"), "another thing"
    assert confirmed(live, "remove hero", "hero goes") and said == ["limp goes", "hero goes"]
    assert not confirmed(live, "remove hero", "hero goes"), "done: it begins anew"
    now[0] += SECONDS + 1
    assert not confirmed(live, "remove hero", "hero goes"), "too late"
