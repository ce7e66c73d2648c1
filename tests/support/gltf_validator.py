"""The Khronos glTF validator, fetched from npm once, into a folder outside the repository."""

import json
import os
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

VALIDATOR = "gltf-validator@2.0.0-dev.3.10"
CACHE = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "patchwalk-tests"
VALIDATE = """const validator = require('gltf-validator'), file = require('fs').readFileSync(process.argv[1]);
validator.validateBytes(new Uint8Array(file)).then(report => console.log(JSON.stringify(report)));"""


def validate(path: Path) -> dict[str, Any]:
    """What the validator says of a file; skips the test where it cannot be had."""
    if not (shutil.which("node") and shutil.which("npm")):
        pytest.skip("the glTF validator needs node and npm")
    if not (CACHE / "node_modules" / "gltf-validator").is_dir():
        CACHE.mkdir(parents=True, exist_ok=True)
        try:
            done = subprocess.run(
                ["npm", "install", "--no-audit", "--no-fund", "--prefix", str(CACHE), VALIDATOR],
                capture_output=True,
                text=True,
                timeout=60,
            )
        except subprocess.TimeoutExpired:
            pytest.skip("npm does not answer: no glTF validator")
        if done.returncode:
            pytest.skip(f"npm cannot fetch the glTF validator: {done.stderr.strip()[-200:]}")
    done = subprocess.run(
        ["node", "-e", VALIDATE, str(path)],
        capture_output=True,
        text=True,
        timeout=60,
        env={**os.environ, "NODE_PATH": str(CACHE / "node_modules")},
    )
    return json.loads(done.stdout)
