# Everything runs in .venv, which each target sets up as far as it needs it.
# Another interpreter: make test PYTHON=python3.12
PYTHON ?= python3
HOME_NAME ?= flat
SEED ?= 1
TESTS ?= tests
JOBS ?= auto
FUZZ ?=
SECONDS ?= 60

VENV := .venv
BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt
DEMO := out/demo

.PHONY: demo image test lint bench soak fuzz clean
.DELETE_ON_ERROR:

# Map a furnished home with the core in the MicroPython VM, on a real pty.
# Another one: make demo HOME_NAME=studio, or HOME_NAME=path/to/home.json
demo: $(VENV)/.ready
	@mkdir -p $(DEMO)
	@$(BIN)/host_tools hil "$(HOME_NAME)" --target unix --seed $(SEED) --out $(DEMO) --json $(DEMO)/result.json
	@echo "The picture is $(DEMO)/map.png, the numbers are in $(DEMO)/result.json, the map is $(DEMO)/map.bin."

# The firmware image for the emulated STM32; the first one takes a minute.
image: $(VENV)/.ready
	@$(BIN)/host_tools flash --target stm32

# One worker a processor; JOBS=0 runs all in one process.
test: $(VENV)/.ready-dev
	@$(BIN)/python -m pytest $(TESTS) --numprocesses $(JOBS) --dist loadfile

lint: $(VENV)/.ready-dev
	@$(BIN)/ruff check .

bench: $(VENV)/.ready-dev
	@$(BIN)/python -m benchmarks

# The same tests with thirty times the examples of each property, and the long campaigns.
soak: $(VENV)/.ready-dev
	@HYPOTHESIS_PROFILE=soak $(BIN)/python -m pytest $(TESTS) --timeout=0 -m "soak or not soak" --numprocesses $(JOBS) --dist worksteal --durations=10

# Coverage-guided fuzzing, SECONDS for each target. Findings: tests/fuzz/found, from where `make test` takes them.
fuzz: $(VENV)/.ready-dev
	@$(PIP) --editable '.[fuzz]'
	@$(BIN)/python -m tests.fuzz $(FUZZ) --seconds $(SECONDS)

clean:
	rm -rf $(VENV) out build dist .pytest_cache .ruff_cache .hypothesis *.egg-info
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

$(VENV)/.ready: pyproject.toml constraints.txt
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null \
	  || { echo "TVSLAM needs Python 3.11 or newer; '$(PYTHON)' is not. Name another: make PYTHON=/path/to/python3"; exit 1; }
	@$(PYTHON) -c 'import ensurepip, venv' 2>/dev/null \
	  || { echo "'$(PYTHON)' has no venv module. On Debian or Ubuntu: apt install python3-venv"; exit 1; }
	@echo "Setting up $(VENV) (about half a minute, once)"
	@$(PYTHON) -m venv $(VENV)
	@$(PIP) --editable '.[unix,plot,board]'
	@touch $@

$(VENV)/.ready-dev: $(VENV)/.ready
	@$(PIP) --editable '.[unix,plot,board,dev]'
	@touch $@
