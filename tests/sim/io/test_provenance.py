"""What weight files say of where they come from."""

import subprocess

from sim.io import provenance as sources


def test_credit_names_archives_and_the_users_own(tmp_path):
    folder = tmp_path / "mocap"
    files = [folder / "accad" / "walk.bvh", folder / "mine" / "limp.bvh"]
    assert sources.credit(folder, files) == f"{sources.ARCHIVES['accad']}; the user's own clips"


def test_the_commit_is_unknown_where_git_is_not_there(monkeypatch):
    assert sources.commit()

    def missing(*_, **__):
        raise FileNotFoundError("git")

    monkeypatch.setattr(subprocess, "run", missing)
    assert sources.commit() == "unknown"
