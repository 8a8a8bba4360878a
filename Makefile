# Two commands do everything on a machine with git, make, Python 3.12 and pip:
#   make demo    the main job: model -> gRPC server -> bridge -> serial lines -> simulated robot, out of a maze
#   make test    every test
# Both make .venv from the lock if it is not there. PYTHON=... chooses the interpreter.

VENV := .venv
BIN := $(VENV)/bin
# The marker is younger than the lock and the project file when the environment is up to date.
READY := $(VENV)/.ready
# Another environment: colcon wants older packages than ours.
COLCON := .venv-colcon
# What looks at the files of deploy/, and what its images are made of.
CHECKERS := .venv-checkers
WHEELS := out/wheels

.PHONY: demo test mutants fuzz lint format bindings lock benchmark environment colcon checkers images extension vscode clean help

help:
	@grep -E '^[a-z]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 14

environment: $(READY) ## make .venv from the lock

$(READY): requirements.lock pyproject.toml deploy/make_environment.sh
	sh deploy/make_environment.sh $(VENV)
	@touch $(READY)

colcon: $(COLCON)/.ready ## make .venv-colcon: builds ROS 2 packages without an installed ROS 2

$(COLCON)/.ready: deploy/requirements-colcon.txt deploy/make_colcon_environment.sh | $(READY)
	PYTHON=$(BIN)/python sh deploy/make_colcon_environment.sh $(COLCON)

checkers: $(CHECKERS)/.ready ## make .venv-checkers: linters of container files, Kubernetes, Prometheus

$(CHECKERS)/.ready: deploy/requirements-checkers.txt deploy/make_checkers.sh | $(READY)
	PYTHON=$(BIN)/python sh deploy/make_checkers.sh $(CHECKERS)
	@touch $@

images: $(WHEELS)/.ready ## fetch what the images are made of, and build them without an engine, for their tests

$(WHEELS)/.ready: deploy/requirements-build.txt deploy/requirements-server.txt deploy/requirements-bridge.txt | $(READY)
	PYTHON=$(BIN)/python sh deploy/make_image_wheels.sh $(WHEELS)
	PYTHONPATH=tests $(BIN)/python -m support.containers
	@touch $@

NPM := npm --no-audit --no-fund --loglevel=error
VSCODE := tests/vscode/node_modules/code-server/lib/vscode

extension: ## make the extension for VS Code, out/robosc.vsix
	$(NPM) ci --prefix editors/vscode --ignore-scripts
	mkdir -p out
	cd editors/vscode && $(NPM) run package -- --out $(CURDIR)/out/robosc.vsix

vscode: ## install the VS Code that the extension's tests run in
	$(NPM) ci --prefix tests/vscode --ignore-scripts
	cd $(VSCODE) && $(NPM) install --omit=dev --ignore-scripts

demo: $(READY) ## lead a simulated robot out of a maze, from model to serial bytes; DEMO='--scene maze-spiral' and so on
	$(BIN)/python deploy/demo/demo.py $(DEMO)

# One worker more than cores: many tests wait for real middleware.
WORKERS := $(shell echo $$(( $$(nproc 2>/dev/null || echo 2) + 1 )))

test: $(READY) ## run every test; TESTS=... chooses, WORKERS=... says how many at a time
	@PYTHON=$(BIN)/python WORKERS=$(WORKERS) sh tests/run.sh $(TESTS)

# mutmut names what it changes by its path, so the packages must lie where it is started.
MUTMUT := PYTHONPATH=$(CURDIR)/out/mutmut $(CURDIR)/$(BIN)/python -m mutmut

mutants: $(READY) ## mutation tests of the bridge's safety layer
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --upgrade --target out/mutmut mutmut==3.8.1
	rm -rf out/mutation
	mkdir -p out/mutation/tests/bridge
	cp -r bridge/robosc_bridge docs pyproject.toml out/mutation
	cp -r tests/support out/mutation/tests
	cp -r tests/bridge/safety out/mutation/tests/bridge
	cd out/mutation && $(MUTMUT) run && $(MUTMUT) results

# atheris exists for some systems only: it is no part of the environment.
DECODERS := lds01 lds02 lds03 mavlink dynamixel registers
SECONDS := 60

fuzz: $(READY) ## fuzz the bridge's decoders; DECODERS=... chooses, SECONDS=... says how long each
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --upgrade --target out/atheris atheris==3.1.0
	cd out && for decoder in $(DECODERS); do \
	  PYTHONPATH=$(CURDIR)/out/atheris $(CURDIR)/$(BIN)/python ../tests/fuzz/fuzz_decoders.py $$decoder \
	    -max_total_time=$(SECONDS) -max_len=2000 -rss_limit_mb=256 || exit 1; \
	done

lint: $(READY) ## formatter, linter, types, import contracts, bindings
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/lint-imports

format: $(READY) ## format and mend what can be mended by itself
	$(BIN)/ruff check --fix-only .
	$(BIN)/ruff format .

bindings: $(READY) ## regenerate the gRPC bindings
	PYTHON=$(BIN)/python sh proto/generate.sh

lock: $(READY) ## choose new versions and write the locks
	$(BIN)/pip-compile --quiet --upgrade --strip-extras --allow-unsafe --generate-hashes --all-build-deps \
	  --no-emit-index-url --no-emit-find-links --no-emit-trusted-host \
	  --extra server --extra postgresql --extra dask --extra tracing --extra client --extra ros2 --extra examples \
	  --extra bridge --extra plot --extra simulation --extra view --extra lsp --extra dev \
	  --output-file requirements.lock pyproject.toml
	$(BIN)/pip-compile --quiet --upgrade --strip-extras --allow-unsafe --generate-hashes \
	  --no-emit-index-url --no-emit-find-links --no-emit-trusted-host \
	  --output-file deploy/requirements-colcon.txt deploy/requirements-colcon.in
	$(BIN)/pip-compile --quiet --upgrade --strip-extras --allow-unsafe --generate-hashes --no-annotate \
	  --no-emit-index-url --no-emit-find-links --no-emit-trusted-host \
	  --output-file deploy/requirements-checkers.txt deploy/requirements-checkers.in
	$(BIN)/python deploy/lock_images.py

benchmark: $(READY) ## print the tables of tests/benchmarks
	$(BIN)/python tests/benchmarks/run.py

clean: ## remove the environment and everything generated
	rm -rf $(VENV) $(COLCON) $(CHECKERS) out build dist .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache
