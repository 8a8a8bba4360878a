# Two commands do everything on a machine with git, make, Python 3.12 and pip:
#   make demo    the main job: model -> gRPC server -> bridge -> serial lines -> simulated robot, out of a maze
#   make test    the tests that need nothing else; `make acceptance` tries the real parts, `make soak` runs random tests for long
# Each makes .venv from the lock if there is none. PYTHON=... chooses the interpreter.

VENV := .venv
BIN := $(VENV)/bin
# The marker is younger than the lock and the project file when the environment is up to date.
READY := $(VENV)/.ready
# Another environment: colcon wants older packages than ours.
COLCON := .venv-colcon
# Tools that check the files of deploy/ and make the site of docs/; wheels that images are made of.
CHECKERS := .venv-checkers
WHEELS := out/wheels

# Programs that the tests start would compile all imports each time without bytecode on disk.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: demo test acceptance smoke soak mutants faults mistakes fuzz lint format bindings lock benchmark environment colcon checkers docs pictures images dist extension vscode clean help

help:
	@grep -E '^[a-z]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 14

environment: $(READY) ## make .venv from the lock

$(READY): requirements.lock deploy/requirements-build.txt pyproject.toml deploy/make_environment.sh deploy/install_lock.sh \
		deploy/build_kernel.py $(wildcard robosc/kernel/*.[ch])
	sh deploy/make_environment.sh $(VENV)
	@touch $(READY)

colcon: $(COLCON)/.ready ## make .venv-colcon: builds ROS 2 packages without an installed ROS 2

$(COLCON)/.ready: deploy/requirements-colcon.txt deploy/make_colcon_environment.sh deploy/install_lock.sh | $(READY)
	BIN=$(BIN) sh deploy/make_colcon_environment.sh $(COLCON)

checkers: $(CHECKERS)/.ready ## make .venv-checkers: linters of container files, Kubernetes, Prometheus; MkDocs

$(CHECKERS)/.ready: deploy/requirements-checkers.txt deploy/make_checkers.sh deploy/install_lock.sh | $(READY)
	BIN=$(BIN) sh deploy/make_checkers.sh $(CHECKERS)
	@touch $@

# The theme announces its successor in each build unless it is asked not to. Not --quiet: a warning that is not printed
# does not count as an error.
docs: $(CHECKERS)/.ready ## build the site of the documentation, out/site; every warning is an error
	NO_MKDOCS_2_WARNING=1 $(CHECKERS)/bin/mkdocs build --strict

pictures: $(READY) ## make the pictures of the README and of docs/ anew; needs Chromium
	$(BIN)/python deploy/draw_scan_to_wheel.py
	PYTHONPATH=tests:examples/robosc_examples $(BIN)/python deploy/draw_courier.py
	PYTHONPATH=tests $(BIN)/python deploy/make_pictures.py

images: $(WHEELS)/.ready ## fetch what the images are made of, and build them without an engine, for their tests

$(WHEELS)/.ready: deploy/requirements-build.txt deploy/requirements-server.txt deploy/requirements-bridge.txt | $(READY)
	PYTHON=$(BIN)/python sh deploy/make_image_wheels.sh $(WHEELS)
	PYTHONPATH=tests $(BIN)/python -m support.containers
	@touch $@

DIST := out/dist
DIST_MACHINE := $(shell uname -m)
DIST_EXTRAS := client server bridge view plot mcap simulation lsp signing

dist: $(READY) ## make out/dist: the wheel, wheels for a machine without network, checksums; DIST_MACHINE=aarch64 for a Raspberry Pi
	PYTHON=$(BIN)/python EXTRAS='$(DIST_EXTRAS)' MACHINE=$(DIST_MACHINE) sh deploy/make_dist.sh $(DIST)

NPM := npm --no-audit --no-fund --loglevel=error
VSCODE := acceptance/vscode/node_modules/code-server/lib/vscode

extension: ## make the extension for VS Code, out/robosc.vsix
	$(NPM) ci --prefix editors/vscode --ignore-scripts
	mkdir -p out
	cd editors/vscode && $(NPM) run package -- --out $(CURDIR)/out/robosc.vsix

vscode: ## install the VS Code that the extension's tests run in
	$(NPM) ci --prefix acceptance/vscode --ignore-scripts
	cd $(VSCODE) && $(NPM) install --omit=dev --ignore-scripts

demo: $(READY) ## drive a simulated robot out of a maze, from model to serial bytes; DEMO='--scene maze-spiral' and so on
	$(BIN)/python deploy/demo/demo.py $(DEMO)

WORKERS := $(shell nproc 2>/dev/null || echo 2)
PYTEST := $(BIN)/python -m pytest

TESTS := tests

test: $(READY) ## the suite that gives the same result on every machine; TESTS=... chooses, WORKERS=... says how many at a time
	$(PYTEST) -n $(WORKERS) --dist worksteal --durations 20 -r fE $(TESTS)

# One worker more than cores: these tests wait for real middleware.
acceptance: $(READY) ## real parts and real time: ROS, compilers, browser, databases, clusters; TESTS=acceptance/... chooses
	@PYTHON=$(BIN)/python WORKERS=$$(( $(WORKERS) + 1 )) sh acceptance/run.sh $(filter-out tests,$(TESTS))

smoke: $(READY) demo ## one of each real part; SMOKE=--no-skips requires all of them
	$(PYTEST) -n $(WORKERS) --dist loadfile --durations 0 --durations-min 1 -r fEsR -m smoke $(SMOKE) acceptance

EFFORT := 20
SEED := $(shell date +%s)

soak: $(READY) ## random tests with EFFORT times the examples, drawn from SEED
	@echo "random tests, $(EFFORT) times the examples: make soak EFFORT=$(EFFORT) SEED=$(SEED)"
	ROBOSC_EFFORT=$(EFFORT) ROBOSC_SEED=$(SEED) $(PYTEST) -n $(WORKERS) --dist worksteal --timeout 7200 -r fE \
	  --hypothesis-seed=$(SEED) -m "hypothesis or random" $(TESTS)

# Tools of `mutants`, `faults` and `fuzz`: some exist for some systems only, so that they are no part of the environment.
TOOLS := out/tools

$(TOOLS)/.ready: deploy/requirements-soak.txt | $(READY)
	rm -rf $(TOOLS)
	$(BIN)/uv pip install --quiet --python $(BIN)/python --target $(TOOLS) --no-deps --require-hashes --no-build -r $<
	@touch $@

# mutmut names what it changes by its path, so the packages must lie where it is started.
MUTMUT := PYTHONPATH=$(CURDIR)/$(TOOLS) $(CURDIR)/$(BIN)/python -m mutmut

mutants: $(TOOLS)/.ready ## mutation tests of the bridge's safety layer
	rm -rf out/mutation
	mkdir -p out/mutation/tests/bridge
	cp -r bridge/robosc_bridge docs pyproject.toml out/mutation
	cp -r tests/support out/mutation/tests
	cp -r tests/bridge/safety out/mutation/tests/bridge
	cd out/mutation && $(MUTMUT) run && $(MUTMUT) results

FAULTS := --number 50 --seed 1

faults: $(TOOLS)/.ready ## put small faults into functions drawn by chance, one at a time, and report which the tests find
	PYTHONPATH=$(CURDIR)/$(TOOLS) $(BIN)/python soak/faults.py $(FAULTS)

MISTAKES :=

mistakes: $(READY) ## print how many mistakes in models get a good message, by category; MISTAKES=--long shows the others
	$(BIN)/python tests/support/mistakes.py $(MISTAKES)

DECODERS := lds01 lds02 lds03 mavlink dynamixel registers
SECONDS := 60

fuzz: $(TOOLS)/.ready ## fuzz the bridge's decoders; DECODERS=... chooses, SECONDS=... says how long each
	cd out && for decoder in $(DECODERS); do \
	  PYTHONPATH=$(CURDIR)/$(TOOLS) $(CURDIR)/$(BIN)/python ../soak/fuzz_decoders.py $$decoder \
	    -max_total_time=$(SECONDS) -max_len=2000 -rss_limit_mb=256 || exit 1; \
	done

lint: $(READY) ## formatter, linter, docstrings, types, import contracts
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/python deploy/check_docstrings.py robosc server client bridge editors proto deploy examples tests acceptance soak
	$(BIN)/mypy
	$(BIN)/lint-imports

format: $(READY) ## format and fix what can be fixed by itself
	$(BIN)/ruff check --fix-only .
	$(BIN)/ruff format .

bindings: $(READY) ## regenerate the gRPC bindings
	PYTHON=$(BIN)/python sh proto/generate.sh

# Extras stay where they are asked for: a lock without them is not complete. `lock_images.py` asks the installed packages
# what they need, so that the new lock has to be installed before.
LOCK := $(BIN)/uv pip compile --quiet --upgrade --no-strip-extras --generate-hashes
COMPILE := $(LOCK) --python-version 3.12
EXTRAS := server postgresql dask tracing client signing ros2 examples bridge plot mcap simulation view lsp build dev

lock: $(READY) ## choose new versions and write the locks
	$(COMPILE) $(EXTRAS:%=--extra %) --output-file requirements.lock pyproject.toml
	for tools in colcon kilted checkers soak; do \
	  $(COMPILE) --output-file deploy/requirements-$$tools.txt deploy/requirements-$$tools.in || exit 1; \
	done
	$(LOCK) --universal --python-version 3.10 --output-file deploy/requirements-rclpy.txt deploy/requirements-rclpy.in
	sh deploy/make_environment.sh $(VENV)
	$(BIN)/python deploy/lock_images.py

benchmark: $(READY) ## print the tables of tests/benchmarks
	$(BIN)/python tests/benchmarks/run.py

clean: ## remove the environment and everything generated
	rm -rf $(VENV) $(COLCON) $(CHECKERS) .venv-rclpy-* out build dist .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache
