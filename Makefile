# Builds everything on a bare Debian or Ubuntu with Python 3.11, git and make. Node comes as a Python package, the tests' browser as
# an npm package. All files stay in .venv, .cache, artefacts and node_modules; `make clean` deletes them.

# The system's own Python if it is new enough. Distributions build theirs with optimizations; with one that was built from source without
# them (as pyenv does) the service takes 1.7 times the processor time to start.
SYSTEM_PYTHON := /usr/bin/python3
PYTHON ?= $(shell $(SYSTEM_PYTHON) -c 'import ensurepip, sys, venv; sys.exit(sys.version_info < (3, 11))' 2>/dev/null \
	&& echo $(SYSTEM_PYTHON) || echo python3)
VENV := .venv
BIN := $(VENV)/bin
export PATH := $(CURDIR)/$(BIN):$(PATH)
# The build is the same everywhere: it does not follow a machine's own settings of pip and npm.
export PIP_DISABLE_PIP_VERSION_CHECK := 1
export npm_config_update_notifier := false
# Without compiled modules, every process of the tests would compile Kata again.
unexport PYTHONDONTWRITEBYTECODE
# The tests keep their files in memory where the system has a folder for it. On a disk they wait for every synced file.
export PYTEST_DEBUG_TEMPROOT := $(wildcard /dev/shm)

PACKAGES := .cache/packages
NODE_MODULES := .cache/node-modules
PAGE := frontend/dist/index.html
BROWSER := .cache/chromium/chromium
JUDGES := .cache/judges
SITE := docs/_build/index.html
SITE_SOURCES := $(shell find docs -type f -not -path "docs/_build/*" -not -name "*.pyc" 2>/dev/null)
PAGE_SOURCES := $(shell find frontend/src frontend/public -type f 2>/dev/null) frontend/index.html frontend/vite.config.ts

.PHONY: help run seed test test-fast dev docs campaign check generate audit lock dist deb bundle clean
.DELETE_ON_ERROR:
# Page, browser and validators are fetched side by side; recipes run their lines in order as always.
MAKEFLAGS += --jobs=3

help: ## list the targets
	@awk -F ':.*## ' '/^[a-z-]+:.*## / {printf "  make %-9s %s\n", $$1, $$2}' Makefile

run: $(PACKAGES) $(PAGE) ## the clinic with a simulated apparatus, at http://127.0.0.1:8000
	@$(BIN)/kata serve --simulate --data .data $(addprefix --station ,$(wildcard .data/station.toml))

seed: $(PACKAGES) ## sixty invented patients with two years of history for `make run`, into an empty clinic
	@$(BIN)/kata seed --data .data

# A worker runs whole modules. Most tests wait often, for a disk, a database, another process or a page: they have one worker more than there
# are processors, and those that wait for the apparatus two more. Tests that move an arm in the test's own process or through a
# pseudo-terminal, and tests that measure, run apart from those that keep both processors busy: the device stops when the service or the bytes
# come too late, as it must.
MEASURED := tests/bench tests/evaluation/test_real_time.py tests/simulator/test_wire.py tests/simulator/test_modbus.py
# The longest first: a worker that begins one at the end leaves the others idle.
TIMED := $(addprefix tests/api/test_,station.py offline_session.py outage.py end_feel.py) tests/integration \
	$(addprefix tests/api/test_,demo.py contraindications.py lease.py crash.py derived.py cli.py episodes.py guarded.py json_bombs.py \
	operations.py restricted_live.py stopping.py teaching_checklist.py visit.py watchdog.py)
# Counting the reached lines and branches takes more than twice the time, so only tests that are needed for it run with it.
COUNTED := -m "counted and not campaign" tests/device
OTHERS := -m "not counted and not campaign" $(addprefix --ignore=,tests/e2e $(MEASURED) $(TIMED))
# Apart from the others, because each worker keeps a clinic running. artefacts/journeys gets a picture of each page on which a journey failed.
JOURNEYS := tests/e2e
# At a lower priority than the kernel's threads. Only the campaign needs the plugin of Schemathesis, whose import takes two seconds.
PYTEST := nice -n 10 $(BIN)/python -m pytest -p no:schemathesis
PARALLEL := $(PYTEST) --dist loadfile --no-loadscope-reorder -n
# On a busy computer the simulated drives can answer too late, and the device stops, as it must. Tests that failed (exit code 1) run once
# more, alone. The output lists both runs.
define once_more
|| { [ $$? = 1 ] && echo "The tests that failed run once more, alone." && \
		$(PYTEST) --last-failed --last-failed-no-failures none $(1); }
endef
test: $(PACKAGES) $(PAGE) $(JUDGES) $(if $(KATA_CHROMIUM),,$(BROWSER)) ## a proof of each requirement, also in a real browser; `make campaign` has the repeated proofs
	@cd frontend && npm test --silent
	@$(PARALLEL) 2 $(COUNTED) --cov
	@$(PARALLEL) 3 $(OTHERS) $(call once_more,$(OTHERS))
	@$(PARALLEL) 2 $(MEASURED) $(call once_more,$(MEASURED))
	@$(PARALLEL) 4 $(TIMED) $(call once_more,$(TIMED))
	@$(PARALLEL) 3 $(JOURNEYS) $(call once_more,$(JOURNEYS))

test-fast: $(PACKAGES) ## the tests of device, motion, station and database, without a browser
	@$(PARALLEL) 2 tests/device tests/motion tests/station tests/database

dev: $(PACKAGES) $(NODE_MODULES) ## like run, with service and page reloading; the page is at http://127.0.0.1:5173
	@$(BIN)/kata serve --simulate --data .data --reload & service=$$!; \
	trap 'kill $$service 2>/dev/null' EXIT INT TERM; \
	(cd frontend && npm run dev --silent); kill $$service 2>/dev/null; wait $$service

docs: $(SITE) ## the documentation, in docs/_build and at /docs/ of a running service; fails on a broken link

campaign: $(PACKAGES) $(PAGE) $(if $(KATA_CHROMIUM),,$(BROWSER)) ## the long campaigns: new examples, ten thousand sequences, two hundred kills, mutations (hours)
	@$(BIN)/python -m pytest --hypothesis-profile exploring --timeout 0 tests/device tests/motion tests/simulator
	@$(BIN)/python -m pytest -m campaign --log-cli-level info --ignore tests/e2e
	@$(BIN)/python -m pytest -m campaign --log-cli-level info tests/e2e
	@$(BIN)/python -m tests.mutation
	@$(BIN)/python -m tests.campaign.reverts

check: $(PACKAGES) $(NODE_MODULES) ## formatting, lint, types and import rules, in both languages
	$(BIN)/ruff format --check --quiet .
	$(BIN)/ruff check --quiet .
	$(BIN)/mypy
	$(BIN)/lint-imports
	cd frontend && npm run lint --silent
	cd frontend && npm run types --silent

generate: $(PACKAGES) $(NODE_MODULES) ## rewrite the generated files: API description and its client, list of messages, reference pages
	@$(BIN)/kata openapi --out frontend/openapi.json
	@$(BIN)/kata messages --out frontend/server-messages.json
	@cd frontend && npm run client --silent && npm run types --silent
	@$(BIN)/python -m docs.generate

# Asks the advisory databases over the network. Without one, tests/repo_checks/lowest_safe.toml lists the lowest safe versions.
audit: $(PACKAGES) $(NODE_MODULES) ## known vulnerabilities of our packages (needs a network)
	$(BIN)/uv tool run --from pip-audit==2.* pip-audit --strict --require-hashes --disable-pip --requirement requirements.txt
	$(BIN)/uv tool run --from pip-audit==2.* pip-audit --strict --require-hashes --disable-pip --requirement requirements-dev.txt
	cd frontend && npm audit --audit-level low

# One environment for running and for development.
$(PACKAGES): requirements-dev.txt pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null || \
		{ echo "Kata needs Python 3.11 or newer; this is $$($(PYTHON) --version 2>&1). Another one: make PYTHON=python3.12 ..."; exit 1; }
	@$(PYTHON) -c 'import ensurepip, venv' 2>/dev/null || \
		{ echo "Python's venv is missing here. On Debian and Ubuntu: sudo apt install python3-venv"; exit 1; }
	@echo "Installing Python packages (half a minute, once) ..."
	@test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	@mkdir -p $(@D)
	@sed -n '/^uv==/,/[^\\]$$/p' requirements-dev.txt > .cache/uv.txt
	@$(BIN)/python -m pip install --quiet --require-hashes --no-deps --requirement .cache/uv.txt
	@# The pins name every package: --no-deps, because pip would look for an extra (coverage[toml]) besides its pin. uv installs side by side what
	@# pip installs one after another. It does not read pip's settings: where they name another index, pip installs.
	@$(BIN)/uv pip install --quiet --no-cache --python $(BIN)/python --require-hashes --no-deps --requirement requirements-dev.txt || \
		$(BIN)/python -m pip install --quiet --require-hashes --no-deps --requirement requirements-dev.txt
	@$(BIN)/python -m pip install --quiet --no-build-isolation --no-deps --editable .
	@$(BIN)/python -m pip check --quiet
	@touch $@

$(NODE_MODULES): $(PACKAGES) frontend/package-lock.json
	@echo "Installing the page's packages (half a minute, once) ..."
	@cd frontend && npm ci --ignore-scripts --loglevel error
	@mkdir -p $(@D) && touch $@

$(PAGE): $(NODE_MODULES) $(PAGE_SOURCES)
	@echo "Building the page ..."
	@cd frontend && npm run build --silent -- --logLevel warn
	@touch $@

SPHINX := $(BIN)/python -m sphinx --quiet --fail-on-warning --keep-going --doctree-dir
$(SITE): $(PACKAGES) $(SITE_SOURCES)
	@$(SPHINX) .cache/doctrees/en docs docs/_build
	@$(SPHINX) .cache/doctrees/ja --conf-dir docs -D language=ja docs/manual/ja docs/_build/manual/ja
	@touch $@

$(BROWSER): $(PACKAGES) tests/browser/package-lock.json tests/browser/unpack.mjs
	@echo "Fetching a browser for the tests (once) ..."
	@cd tests/browser && npm ci --ignore-scripts --omit=optional --loglevel error
	@node tests/browser/unpack.mjs $(@D)
	@touch $@

$(JUDGES): $(PACKAGES) tests/fhir_validators/package-lock.json
	@echo "Fetching the validators of FHIR and Parquet (once) ..."
	@cd tests/fhir_validators && npm ci --ignore-scripts --loglevel error
	@mkdir -p $(@D) && touch $@

# Locks are made from nothing: npm drops the packages of other platforms when it changes a lock. Pins have hashes and no address: the
# installing machine chooses the registry. --no-config and the public index keep this machine's settings out of the hashes.
COMPILE = $(BIN)/uv pip compile --quiet --universal --python-version 3.11 --generate-hashes --no-header --no-config \
	--no-emit-index-url --no-emit-find-links --no-annotate --upgrade

lock: $(PACKAGES) ## new pins after a change of pyproject.toml
	env -u UV_FIND_LINKS -u PIP_FIND_LINKS $(COMPILE) pyproject.toml --extra postgresql -o requirements.txt
	env -u UV_FIND_LINKS -u PIP_FIND_LINKS $(COMPILE) pyproject.toml --group dev -c requirements.txt -o requirements-dev.txt
	cd frontend && rm -rf node_modules package-lock.json && npm install --ignore-scripts --package-lock-only
	cd tests/browser && rm -rf node_modules package-lock.json && npm install --ignore-scripts --package-lock-only
	cd tests/fhir_validators && rm -rf node_modules package-lock.json && npm install --ignore-scripts --package-lock-only

# From a copy of the last commit: the build installs the page's packages beside its sources.
dist: $(PACKAGES) ## wheel and sdist of the last commit, in the folder dist
	@rm -rf .cache/dist dist && mkdir -p .cache/dist && git archive HEAD | tar x -C .cache/dist
	@cd .cache/dist && $(CURDIR)/$(BIN)/python -m hatchling build -t sdist -t wheel -d $(CURDIR)/dist
	@rm -rf .cache/dist

# With wheels for this computer's processor and Python.
WHEELS = rm -rf .cache/wheels && $(BIN)/python -m pip wheel --quiet --no-deps --require-hashes --wheel-dir .cache/wheels \
	--requirement requirements.txt && cp dist/*.whl .cache/wheels
VERSION = $$(sed -n 's/^__version__ = "\(.*\)"/\1/p' backend/kata/__init__.py)
deb: dist ## Debian package of the last commit with all Python packages, in the folder dist
	@$(WHEELS)
	@SOURCE_DATE_EPOCH=$$(git log -1 --format=%ct) deploy/debian/build.sh $(VERSION) .cache/wheels dist

bundle: dist ## the same for `kata update`, signed: make bundle KEY=private.pem
	@test -n "$(KEY)" || { echo "Name the private key: make bundle KEY=private.pem"; exit 1; }
	@$(WHEELS)
	@$(BIN)/python -m kata.system.update_bundle --key "$(KEY)" --version $(VERSION) --out dist/kata-$(VERSION).bundle .cache/wheels/*.whl

clean: ## delete everything that was made, except the clinic's data in .data
	rm -rf $(VENV) .cache artefacts dist frontend/node_modules frontend/dist docs/_build tests/browser/node_modules tests/fhir_validators/node_modules \
		.mypy_cache .ruff_cache .pytest_cache .import_linter_cache .hypothesis
