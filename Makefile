# make fly        set up, generate the C of preset mambo, compile it, fly Table II; results in build/fly
# make test       set up, check style and types, run the tests; with CI=true also the long ones
# make generated  write the committed bundles in generated/ anew
# make bench      measure against RotorPy; results on stdout
# make clean      remove build/ and the virtual environment

PYTHON ?= python3
VENV = .venv
BIN = $(VENV)/bin
SETUP = $(VENV)/.installed
SETUP_TEST = $(VENV)/.installed-test
SETUP_BENCH = $(VENV)/.installed-bench
PIP_INSTALL = $(BIN)/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt --editable

# What the tests want beside a C compiler; named as Debian names it.
TOOLS = gcc g++ clang make cmake binutils

ifeq ($(CI),true)
MARKED = -m "long or not long"
endif

.PHONY: fly test tools generated bench clean

fly: $(SETUP)
	$(BIN)/mambo-nmpc generate mambo -o build/mambo
	$(BIN)/mambo-nmpc table2 -o build/fly
	@echo "pictures: build/fly/figure3.png and .svg; the C: build/mambo"

test: tools $(SETUP_TEST)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/python -m pytest -n auto $(MARKED)

# Where there is apt and the right to use it, install what is missing; elsewhere say what to install.
tools:
	@missing=""; for tool in gcc g++ clang make cmake nm; do command -v $$tool >/dev/null || missing=yes; done; \
	if [ -z "$$missing" ]; then exit 0; fi; \
	if command -v apt-get >/dev/null && [ "$$(id -u)" = 0 ]; then \
	    apt-get update --quiet=2 && apt-get install --quiet=2 --yes --no-install-recommends $(TOOLS) >/dev/null; \
	else \
	    echo "some tests will be skipped without these tools; install: $(TOOLS)"; \
	fi

generated: $(SETUP)
	$(BIN)/mambo-nmpc generate mambo -o generated/mambo
	$(BIN)/mambo-nmpc generate mambo --scalar float64 -o generated/mambo-float64
	$(BIN)/mambo-nmpc generate table1 -o generated/table1

bench: $(SETUP_BENCH)
	$(BIN)/python -m benchmarks.flights

$(VENV)/bin/python:
	$(PYTHON) -m venv $(VENV)

$(SETUP): pyproject.toml constraints.txt | $(VENV)/bin/python
	$(PIP_INSTALL) .
	@touch $@

$(SETUP_TEST): pyproject.toml constraints.txt | $(VENV)/bin/python
	$(PIP_INSTALL) ".[test]"
	@touch $@ $(SETUP)

$(SETUP_BENCH): pyproject.toml constraints.txt | $(VENV)/bin/python
	$(PIP_INSTALL) ".[bench]"
	@touch $@ $(SETUP)

clean:
	rm -rf build $(VENV)
