# make demo   build into .venv and run the main job
# make test   build into .venv and run all tests, on all cores
# make quick  the tests that are neither marked slow nor need a browser: a minute
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
SOURCES := CMakeLists.txt pyproject.toml $(shell find sphshell_pin/cpp -name '*.[ch]pp')
CPP := $(shell find sphshell_pin/cpp -name '*.[ch]pp')
OUT ?= results
# Modules are compiled once, and not in every process of the tests.
unexport PYTHONDONTWRITEBYTECODE

.DEFAULT_GOAL := help
.PHONY: help demo test quick bench hard-cases work-precision lint format report robots sweep-survival kills rollouts real-surfaces wheel docs fuzz sanitize clean

help:
	@sed -n 's/^# make/make/p' Makefile

# make lint   check style and types; make format mends the style
# make bench  print what contact costs, as ratios
# make hard-cases      run every hard case and write docs/hard_cases.md
# make work-precision  print error against computing time of the integrators, draw the figure
# make wheel  build a wheel into dist/ and run it in an environment without a compiler
# make docs   build the documentation site into build/site
# make report measure speed against error, a page in results/report
# make robots check every robot and write docs/robots.md
# make sweep-survival  500 runs five ways, workers killed and the sweep resumed: the same bytes
# make kills           kill runs at every system call and at random times, fill disks (15 min)
# make rollouts        print the speed-up of 10 000 runs over threads
# make real-surfaces FOLDER=...  jumps and energies over the surfaces of a folder
# make fuzz SECONDS=600 SEED=1  damaged files for every reader, until one breaks it
# make sanitize        run tests with checks of memory, undefined behaviour and data races
# make clean  remove everything that was built

# uv downloads in parallel and links what it has unpacked once; pip installs whatever uv cannot.
FETCH = -$(BIN)/uv pip install -q --python $(BIN)/python
PIP = $(BIN)/python -m pip install -q
BUILD = $(shell $(PYTHON) -c 'import tomllib; \
	print(*map(repr, tomllib.load(open("pyproject.toml", "rb"))["build-system"]["requires"]))')

$(BIN)/python:
	$(PYTHON) -m venv $(VENV)
	-$(PIP) uv

# What the build needs stays in the environment: after a change only what it concerns is compiled.
$(VENV)/.build: $(BIN)/python pyproject.toml
	$(FETCH) cmake ninja $(BUILD)
	$(PIP) cmake ninja $(BUILD)
	@touch $@

# $(call install,EXTRAS)
comma := ,
define install
	$(FETCH) -r pyproject.toml $(addprefix --extra ,$(1))
	@echo "Building sphshell_pin into $(VENV): about 80 seconds"
	$(PIP) --no-build-isolation -e '.[$(subst $() ,$(comma),$(1))]'
	@touch $@ $(VENV)/.demo
endef

# One stamp per set of extras; a change of the C++ sources or of the packaging builds anew.
$(VENV)/.demo: $(VENV)/.build $(SOURCES)
	$(call install,view robots)

$(VENV)/.test: $(VENV)/.build $(SOURCES)
	$(call install,test)

demo: $(VENV)/.demo
	$(BIN)/sphshell-pin run fingertip_on_blade --out $(OUT)/fingertip_on_blade

# ARGS="-k blade": more arguments; whoever ends early takes over tests of another process.
PYTEST = $(BIN)/python -m pytest -n auto --dist worksteal $(ARGS)

test: $(VENV)/.test
	$(PYTEST)

quick: $(VENV)/.test
	$(PYTEST) -m "not slow and not browser" --durations=10

$(VENV)/.bench: $(VENV)/.test
	$(BIN)/python -m pip install -q -e '.[bench]'
	@touch $@

hard-cases: $(VENV)/.test
	$(BIN)/python -m tests.hard_cases --write

robots: $(VENV)/.test
	$(BIN)/sphshell-pin check-robot --all --write docs/robots.md

report: $(VENV)/.bench
	$(BIN)/sphshell-pin report --out $(OUT)/report

sweep-survival: $(VENV)/.test
	$(BIN)/python -m tests.study.sweep_survival

kills: $(VENV)/.test
	$(BIN)/python -m tests.scenario.kills

rollouts: $(VENV)/.test
	$(BIN)/python -m benchmarks.rollout

real-surfaces: $(VENV)/.test
	$(BIN)/python -m benchmarks.real_surfaces $(or $(FOLDER),tests/data/corpus)

fuzz: $(VENV)/.test
	$(BIN)/python -m tests.fuzz --seconds $(or $(SECONDS),60) --seed $(or $(SEED),1)
	$(BIN)/python -m tests.fuzz.cad --seconds $(or $(SECONDS),60) --seed $(or $(SEED),1)

work-precision: $(VENV)/.test
	$(BIN)/python -m benchmarks.work_precision --write

bench: $(VENV)/.bench
	$(BIN)/python -m benchmarks

lint: $(VENV)/.test
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/clang-format --dry-run --Werror $(CPP)

format: $(VENV)/.test
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .
	$(BIN)/clang-format -i $(CPP)

sanitize: $(VENV)/.test
	.ci/sanitize address
	.ci/sanitize thread

wheel: $(BIN)/python
	rm -rf dist
	$(BIN)/python -m pip wheel -q . --no-deps -w dist
	$(BIN)/python .ci/check_wheel.py dist/*.whl

docs: $(VENV)/.test
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict
	@echo "See it: $(BIN)/python -m http.server -d build/site --bind 127.0.0.1"

clean:
	rm -rf $(VENV) build dist $(OUT)
