# make demo: both gearbox configurations from gear drawing to sound pressure.  make test: the tests of a change.
# Each makes the virtual environment first if it is not there.

PYTHON ?= python3
VENV ?= .venv
FIDELITY ?= standard
OUT ?= out
BIN := $(VENV)/bin
READY := $(VENV)/.ready
# two processes on two cores: threads of their libraries would only wait for each other;
# commands that tests start read modules that are compiled once, also where the environment forbids to keep them
TESTS := PYTHONDONTWRITEBYTECODE= OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 MKL_NUM_THREADS=1 $(BIN)/python -m pytest --durations=15 -n 2 --dist loadfile --no-loadscope-reorder

.PHONY: help setup demo gallery test test-all extremes kills lies lint docs clean distclean

help:
	@echo "make demo       compare the solid and the slotted gearbox, results in $(OUT)/  (FIDELITY=draft|standard|reference)"
	@echo "make gallery    make figures and tables of the thesis, chapters 3 to 5, in $(OUT)/gallery/  (FIDELITY=...)"
	@echo "make test       run the tests that a change needs;  make test-all also runs those marked slow"
	@echo "make extremes   try thousands of generated cases within and beyond sense"
	@echo "make kills      random signals to commands and their children  (KILLS=500 SEED=1)"
	@echo "make lies       damaged cases, files and hand-offs, full disks, long runs  (LIES=5000 SEED=1)"
	@echo "make lint       style, formatting, types and docstrings"
	@echo "make docs       build the documentation in docs/_build/html"
	@echo "make clean      remove results and caches;  make distclean also removes $(VENV)/"

setup: $(READY)

$(READY): pyproject.toml constraints.txt scripts/prepare.sh
	@sh scripts/prepare.sh "$(PYTHON)" "$(VENV)"
	@touch $@

demo: $(READY)
	$(BIN)/nvhchain compare cases/gearbox/solid.toml cases/gearbox/slotted.toml --fidelity $(FIDELITY) --out $(OUT) --speeds 500:3000:100

gallery: $(READY)
	$(BIN)/python -m nvhchain.gallery --fidelity $(FIDELITY) --out $(OUT)/gallery

test: $(READY)
	$(TESTS) -m "not slow"

test-all: $(READY)
	$(TESTS)

extremes: $(READY)
	NVHCHAIN_EXTREMES=1000 $(BIN)/python -m pytest tests/extremes

kills: $(READY)
	$(BIN)/python -m benchmarks kills $(or $(KILLS),500) $(or $(SEED),1)

lies: $(READY)
	$(BIN)/python -m benchmarks lies $(or $(LIES),5000) $(or $(SEED),1)
	$(BIN)/python -m benchmarks growth $$(( $(or $(LIES),5000) / 10 ))

lint: $(READY)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/python -m scripts.docstrings

docs: $(READY)
	$(BIN)/python -m sphinx -W --keep-going -q -b html docs docs/_build/html
	@echo "docs/_build/html/index.html"

clean:
	rm -rf $(OUT) docs/_build build .pytest_cache .mypy_cache .ruff_cache .import_linter_cache
	find . -name __pycache__ -not -path "./$(VENV)/*" -prune -exec rm -rf {} +

distclean: clean
	rm -rf $(VENV) nvhchain.egg-info
