"""What weight files say of where they come from."""

import subprocess
from types import SimpleNamespace

from sim.io import provenance


def test_credit_names_archives_and_the_users_own(tmp_path):
    folder = tmp_path / "mocap"
    files = [folder / "accad" / "walk.bvh", folder / "mine" / "limp.bvh"]
    assert provenance.credit(folder, files) == f"{provenance.ARCHIVES['accad']}; the user's own clips"


def test_the_commit_is_what_git_says_and_unknown_where_it_says_nothing_or_is_not_there(monkeypatch):
    for said, commit in (("0123abc\n", "0123abc"), ("", "unknown")):
        monkeypatch.setattr(subprocess, "run", lambda *_, said=said, **__: SimpleNamespace(stdout=said))
        assert provenance.commit() == commit

    def missing(*_, **__):
        raise FileNotFoundError("git")

    monkeypatch.setattr(subprocess, "run", missing)
    assert provenance.commit() == "unknown"
