# make run: builds .venv and opens the window (without a display: replays the bundled recording into out/).
# make test: the tests. make check: ruff, mypy, then the tests.
# PYTHON=/path/to/python3.12 chooses the interpreter.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin

.PHONY: run test check clean

run: $(VENV)/.installed-run
	@$(BIN)/patchwalk

test: $(VENV)/.installed-test
	@$(BIN)/python -m pytest

check: $(VENV)/.installed-check
	@$(BIN)/ruff format --check . && $(BIN)/ruff check . && $(BIN)/mypy
	@$(MAKE) --no-print-directory test

# Installed again only when pyproject.toml has changed.
$(VENV)/.installed-run: EXTRAS := video,serve
$(VENV)/.installed-test: EXTRAS := video,serve,export,test
$(VENV)/.installed-check: EXTRAS := video,serve,export,test,check
$(VENV)/.installed-%: pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null || { \
	  echo "patchwalk: '$(PYTHON)' is not Python 3.11 or newer; install one and say which: make $* PYTHON=/path/to/python3" >&2; exit 1; }
	@test -x $(BIN)/python || $(PYTHON) -m venv $(VENV) || { \
	  rm -rf $(VENV); echo "patchwalk: '$(PYTHON) -m venv' failed; on Debian and Ubuntu, first: apt install python3-venv" >&2; exit 1; }
	@echo "Installing Patchwalk into $(VENV) (PyTorch is 200 MB or more; this happens once)"
	@$(BIN)/python -m pip install --quiet $$($(BIN)/python -c "$$TORCH_INDEX") --editable '.[$(EXTRAS)]'
	@touch $@

clean:
	rm -rf $(VENV) build out *.egg-info

# On Linux PyPI's PyTorch brings gigabytes of CUDA: without an NVIDIA driver, ask PyTorch's own index for the CPU build, if it answers.
define TORCH_INDEX
import platform, shutil, urllib.request
index = 'https://download.pytorch.org/whl/cpu'
if platform.system() == 'Linux' and not shutil.which('nvidia-smi'):
    try:
        urllib.request.urlopen(index + '/torch/', timeout=5).close()
        print('--extra-index-url', index)
    except OSError:
        pass
endef
export TORCH_INDEX
