PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
# What the Python module is made of; the C++ library has more.
CPP := $(shell find sphshell_pin/cpp -name '*.[ch]pp' -not -path '*/cpp/library/*')
ALL_CPP := $(shell find sphshell_pin/cpp tests/cpp docs/examples -name '*.[ch]pp')
OUT ?= results
# Modules are compiled once, and not in every process of the tests.
unexport PYTHONDONTWRITEBYTECODE

.DEFAULT_GOAL := help
.PHONY: help demo test quick slow-tests studies lint format bench report robots validation hard-cases rollouts \
  joints real-surfaces new-study parts fuzz sanitize wheel notebooks docs docs-serve clean

help:
	@sed -nE 's/^([a-z-]+):.* ## (.*)/make \1\t\2/p' Makefile | expand -t 22

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

# One stamp per set of extras; a change of the C++ sources or of the packaging builds anew.
comma := ,
define install # EXTRAS
	$(FETCH) -r pyproject.toml $(addprefix --extra ,$(1))
	@echo "Building sphshell_pin into $(VENV): about two minutes"
	$(PIP) --no-build-isolation -e '.[$(subst $() ,$(comma),$(1))]'
	@touch $@ $(VENV)/.demo
endef

$(VENV)/.demo: $(VENV)/.build CMakeLists.txt $(CPP)
	$(call install,view robots cad)

$(VENV)/.test: $(VENV)/.build CMakeLists.txt $(CPP)
	$(call install,test)

$(VENV)/.bench: $(VENV)/.test benchmarks/pyproject.toml
	$(PIP) -e benchmarks
	@touch $@

demo: $(VENV)/.demo ## build into .venv and run fingertip_on_blade
	$(BIN)/sphshell-pin run fingertip_on_blade --out $(OUT)/fingertip_on_blade

# A process that has finished takes over tests of another one. ARGS="-k blade": more arguments.
PYTEST = $(BIN)/python -m pytest -n auto --dist worksteal $(ARGS)

# The C++ library, for its tests.
$(VENV)/.cpp: $(VENV)/.test
	@echo "Building the C++ library into build/cpp: about three minutes"
	$(BIN)/python -m tests.test_cpp
	@touch $@

test: $(VENV)/.cpp ## build into .venv and run the tests, on all cores
	$(PYTEST)

quick: $(VENV)/.test ## the tests that are not slow and need no browser
	$(PYTEST) -m "not (slow or study or browser)" --durations=10

slow-tests: $(VENV)/.test ## measure which tests are slow, for tests/slow.txt
	$(PYTEST) -p tests.slow

studies: $(VENV)/.test ## the same laws over every robot, surface and start, which make test leaves out
	$(PYTEST) -m study

lint: $(VENV)/.test ## check style and types
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/clang-format --dry-run --Werror $(ALL_CPP)

format: $(VENV)/.test ## correct the style
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .
	$(BIN)/clang-format -i $(ALL_CPP)

bench: $(VENV)/.bench ## time and memory of queries beside other codes, up to 5 M triangles
	$(BIN)/python -m benchmarks.growth

report: $(VENV)/.test ## measure speed against error: a page in results/report
	$(BIN)/sphshell-pin report --out $(OUT)/report

robots: $(VENV)/.test ## check every robot, for docs/robots.md
	$(BIN)/sphshell-pin check-robot --all --json docs/measured/robots.json

validation: $(VENV)/.test ## compare with published experiments, for docs/validation.md
	$(BIN)/python -m tests.validation

hard-cases: $(VENV)/.test ## run every hard case, for docs/hard_cases.md
	$(BIN)/python -m tests.hard_cases --write

rollouts: $(VENV)/.test ## print the speed-up of 10 000 runs over threads
	$(BIN)/python -m benchmarks.rollout

joints: $(VENV)/.test ## spheres over every joint between faces of generated parts (COUNT=1000000 SEED=1)
	$(BIN)/python -m tests.joints --count $(or $(COUNT),1000000) --seed $(or $(SEED),1)

real-surfaces: $(VENV)/.test ## answers to 1500 spheres on each surface of FOLDER=..., and jumps along walks
	SPHSHELL_FOLDER=$(abspath $(FOLDER)) $(PYTEST) tests/contact/smooth/test_real_surfaces.py -m ""

new-study: $(VENV)/.test ## what `new` writes for 22 robots and the parts of FOLDER=...
	$(BIN)/python -m tests.new_study $(or $(FOLDER),tests/data/corpus)

parts: $(VENV)/.test ## what STL files of 300 generated parts cost against their CAD faces (COUNT=300 SEED=1)
	$(BIN)/python -m tests.parts --count $(or $(COUNT),300) --seed $(or $(SEED),1)

fuzz: $(VENV)/.test ## damaged files, folders of robots and results for every reader, until one breaks it (SECONDS=600 SEED=1)
	$(BIN)/python -m tests.fuzz --seconds $(or $(SECONDS),60) --seed $(or $(SEED),1)

sanitize: $(VENV)/.test ## run tests with checks of memory, undefined behavior and data races
	.ci/sanitize address
	.ci/sanitize thread

wheel: $(BIN)/python ## build a wheel into dist/ and run it in an environment without a compiler
	rm -rf dist
	$(BIN)/python -m pip wheel -q . --no-deps -w dist
	$(BIN)/python .ci/check_wheel.py dist/*.whl

# An example is executed again when it has changed; `make clean` when the package has.
NOTEBOOKS := $(patsubst docs/examples/%.py,build/notebooks/%.ipynb,$(wildcard docs/examples/*.py))

build/notebooks/%.ipynb: docs/examples/%.py docs/site/notebooks.py $(VENV)/.test
	$(BIN)/python docs/site/notebooks.py build/notebooks $*

notebooks: $(NOTEBOOKS) ## execute the examples as notebooks, in build/notebooks: a minute

docs: $(VENV)/.test $(NOTEBOOKS) ## build the documentation site into build/site
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict
	@echo "See it: build/site/index.html, or make docs-serve"

docs-serve: docs ## serve the documentation site at http://127.0.0.1:8000
	$(BIN)/python -m http.server 8000 -d build/site --bind 127.0.0.1

clean: ## remove everything that was built
	rm -rf $(VENV) build dist $(OUT)
