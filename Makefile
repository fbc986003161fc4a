# make fly        set up, generate the C of preset mambo, compile it, fly Table II, show the picture; results in build/fly
# make check      style, types, and the tests that need no compiler: what to run while editing
# make test       set up everything, check style and types, run the tests; with CI=true also the long ones
#                 TOOLS=no installs no system packages: tests whose tool is missing are skipped by name
# make lowest     the tests that need no compiler, and those of a few commands, with the least versions of the dependencies
# make thorough   the same with every case of the tests of which CI runs a sample, such as every fault of Python
# make proofs     make all proofs with Frama-C anew; CI makes only those that are not in tests/verify/proven.txt
# make tools      install the compilers and emulators that the tests want, or say which
# make generated  write the committed bundles in generated/ anew
# make docs       build the manual; its first page is build/docs/index.html
# make evidence   fly and measure anew those tables and pictures of docs/evidence that are older than the code
# make bench      time flights against RotorPy, and updates against peers; results in build/bench
# make bench-peers  measure solvers of others on the problem of a control step; wants newlib for Arm
# make clean      remove build/ and the virtual environment

PYTHON ?= python3
VENV = .venv
BIN = $(VENV)/bin
SETUP = $(VENV)/.installed
SETUP_TEST = $(VENV)/.installed-test
SETUP_BENCH = $(VENV)/.installed-bench
SETUP_DOCS = $(VENV)/.installed-docs
SETUP_SIMULATORS = $(VENV)/.installed-simulators
PEERS = build/peers
SETUP_PEERS = $(PEERS)/.installed
PIP_INSTALL = $(BIN)/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt --editable

# Compilers, emulators and analysers that the tests want: Debian's packages, and the commands that show them.
TOOL_PACKAGES = gcc g++ clang make cmake binutils python3-dev \
    gcc-arm-linux-gnueabi libc6-dev-armel-cross gcc-arm-none-eabi gcc-riscv64-unknown-elf gcc-avr avr-libc arduino-core-avr \
    qemu-system-misc qemu-system-arm qemu-user libsimavr-dev \
    frama-c-base cppcheck libclang-rt-14-dev lld chromium
TOOL_COMMANDS = gcc g++ clang make cmake nm \
    arm-linux-gnueabi-gcc arm-none-eabi-gcc riscv64-unknown-elf-gcc avr-gcc qemu-system-avr qemu-system-arm qemu-arm \
    frama-c cppcheck wasm-ld chromium
SIMAVR = /usr/include/simavr/sim_avr.h

ifeq ($(CI),true)
MARKED = -m "not thorough"
endif

# Tests that need no compiler and take seconds. They run with a PATH on which there is none.
CHECKED = tests/test_house.py tests/experiment/campaign/test_campaign.py tests/results tests/board/firmware \
    $(filter-out %/test_generations.py %/test_quadratic_loop.py %/test_quadratic.py %/test_quadratic_settings.py %/test_targets.py,$(wildcard tests/codegen/test_*.py)) tests/flight/test_metrics.py tests/flight/test_scenario.py tests/flight/test_traces.py \
    tests/flight/test_trajectories.py tests/drone/plant tests/drone/sensors

# Beside them, with the least versions: the text of the bundles, the commands that derive, generate, fly and judge, and the
# disassembler and emulator. It leaves out what compares bits of C and reference in every build, and what wants optional packages.
LOWEST = build/lowest
LOWEST_TESTED = $(filter-out tests/test_house.py tests/board/firmware tests/drone/plant \
        $(addprefix tests/codegen/test_,kernel_page.py prefixes.py sbom.py),$(CHECKED)) tests/templates/test_generated.py tests/templates/test_parity.py \
    tests/cli/test_design.py tests/cli/test_fly.py tests/cli/test_identify.py \
    tests/experiment/margins/test_command.py tests/verify/test_replay.py tests/board/footprint/test_counts.py

PICTURE = build/fly/figure3.png

# A machine without a screen has the path, printed above.
define SHOW_PICTURE
@if [ "$$(uname)" = Darwin ]; then open $(PICTURE) || true; \
elif [ -n "$$DISPLAY$$WAYLAND_DISPLAY" ] && command -v xdg-open >/dev/null; then xdg-open $(PICTURE) >/dev/null 2>&1 & fi
endef

.PHONY: fly check test lowest thorough proofs tools generated docs evidence bench bench-peers clean

fly: $(SETUP)
	$(BIN)/mambo-nmpc generate mambo -o build/mambo
	$(BIN)/mambo-nmpc table2 -o build/fly
	@echo "picture: $(PICTURE); the C: build/mambo; this table, explained: docs/tutorials/paper.md"
	$(SHOW_PICTURE)

check: $(SETUP_TEST)
	$(STYLE_AND_TYPES)
	@CI= PATH="$(CURDIR)/$(BIN)" $(BIN)/python -m pytest -q -r fE -n auto $(CHECKED)

test: tools $(SETUP_TEST)
	$(STYLE_AND_TYPES)
	$(BIN)/python -m pytest -n auto --dist worksteal $(MARKED)
	$(if $(filter true,$(CI)),$(MAKE) lowest)

# Packages of that age use what newer ones deprecate.
lowest:
	$(PYTHON) -m venv --clear $(LOWEST)
	sed -nE 's/^(emulation = \[| *)"([a-z0-9]*)>=([0-9.]*)"[],]$$/\2==\3/p' pyproject.toml > $(LOWEST)/least.txt
	$(LOWEST)/bin/python -m pip install --quiet --disable-pip-version-check --constraint $(LOWEST)/least.txt \
	    --editable ".[emulation]" hypothesis jsonschema pytest pytest-xdist
	@CI= PATH="$(CURDIR)/$(LOWEST)/bin:$$PATH" $(LOWEST)/bin/python -m pytest -q -n auto -W ignore::DeprecationWarning \
	    $(LOWEST_TESTED)

# All cases of the tests that CI samples too, and all proofs.
thorough: MARKED = -m "thorough or not thorough"
thorough: export PROOFS = anew
thorough: $(SETUP_SIMULATORS) test

# The record of proofs is written anew, so that it has no line that no test wants.
proofs: export PROOFS = anew
proofs: $(SETUP_TEST)
	rm -f tests/verify/proven.txt
	$(BIN)/python -m pytest -n auto -m "thorough or not thorough" -k "proven or raises_an_alarm" tests/verify

# As root on a system with apt, install all packages if a command is missing; elsewhere name them.
tools:
	@missing=""; for tool in $(TOOL_COMMANDS); do command -v $$tool >/dev/null || missing="$$missing $$tool"; done; \
	[ -e $(SIMAVR) ] || missing="$$missing $(SIMAVR)"; \
	if [ -z "$$missing" ]; then exit 0; fi; \
	echo "missing on this system:$$missing"; \
	if [ "$(TOOLS)" != no ] && command -v apt-get >/dev/null && [ "$$(id -u)" = 0 ]; then \
	    echo "installing with apt-get, which 'make test TOOLS=no' does not: $(TOOL_PACKAGES)"; \
	    apt-get update --quiet=2 && \
	    apt-get install --quiet=2 --yes --no-install-recommends $(TOOL_PACKAGES) >/dev/null; \
	else \
	    echo "tests that need one of them are skipped; Debian's packages: $(TOOL_PACKAGES)"; \
	fi

generated: $(SETUP)
	$(BIN)/python -m benchmarks.generated
	$(BIN)/python -m docs.pages.written
	$(BIN)/mambo-nmpc generate mambo -o generated/mambo
	$(BIN)/mambo-nmpc generate mambo --scalar fixed -o build/generated/mambo-fixed
	$(BIN)/mambo-nmpc generate table1 -o build/generated/table1
	for name in mambo-fixed table1; do \
	    cp build/generated/$$name/nmpc.[ch] build/generated/$$name/manifest.json generated/$$name; done

docs: $(SETUP_DOCS)
	NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build --strict
	@echo "the manual: build/docs/index.html; its search wants a server: python3 -m http.server -d build/docs"

evidence: $(SETUP_TEST)
	$(BIN)/python -m benchmarks.evidence

bench: $(SETUP_BENCH) $(SETUP_PEERS)
	$(BIN)/python -m benchmarks.speed.flight_times
	$(BIN)/python -m benchmarks.speed.command_times
	$(BIN)/python -m benchmarks.peers.times
	$(BIN)/python -m benchmarks.peers.quadratic_times

bench-peers: $(SETUP_TEST) $(SETUP_PEERS)
	$(BIN)/python -m benchmarks.evidence peers

# The generators of others live in an environment of their own; TinyMPC asks for a SciPy that new Pythons lack.
# Of DAQP the C is wanted, which only the source distribution has.
$(SETUP_PEERS): Makefile
	$(PYTHON) -m venv --clear $(PEERS)
	$(PEERS)/bin/python -m pip install --quiet osqp==1.1.3 casadi==3.8.2 cvxpygen==1.0.2 qocogen==0.1.9 daqp==0.11.0
	$(PEERS)/bin/python -m pip install --quiet --no-deps tinympc==0.0.8
	$(PEERS)/bin/python -m pip download --quiet --no-deps --no-binary daqp --dest $(PEERS)/sdist daqp==0.11.0
	@touch $@

# A virtual environment without pip is what a stopped run left, and is made anew.
define SET_UP
@echo "setting up (about a minute, downloads packages)"
@$(BIN)/python -m pip --version >/dev/null 2>&1 || $(PYTHON) -m venv --clear $(VENV)
endef

$(SETUP): pyproject.toml constraints.txt
	$(SET_UP)
	$(PIP_INSTALL) .
	@touch $@

$(SETUP_TEST): pyproject.toml constraints.txt
	$(SET_UP)
	$(PIP_INSTALL) ".[test]"
	@touch $@ $(SETUP) $(SETUP_DOCS)

$(SETUP_SIMULATORS): $(SETUP_TEST)
	$(PIP_INSTALL) ".[crazyflow,drake,mujoco]"
	@touch $@

$(SETUP_DOCS): pyproject.toml constraints.txt
	$(SET_UP)
	$(PIP_INSTALL) ".[docs]"
	@touch $@ $(SETUP)

$(SETUP_BENCH): pyproject.toml constraints.txt
	$(SET_UP)
	$(PIP_INSTALL) ".[bench]"
	@touch $@ $(SETUP)

define STYLE_AND_TYPES
$(BIN)/ruff check .
$(BIN)/ruff format --check .
$(BIN)/lint-imports
$(BIN)/mypy
endef

clean:
	rm -rf build $(VENV)
