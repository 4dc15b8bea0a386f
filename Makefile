# Each target does all set-up itself; it needs CPython 3.11, 3.12 or 3.13 with venv, and nothing
# else. PYTHON=/path/to/python3.13 or PYTHON=3.13 chooses the Python, PYTHON=auto lets uv download
# one where none is at hand, OUTPUT=DIR chooses the folder of the demo's report.

PYTHON ?=
VENV := .venv
RUN := $(VENV)/bin
READY := $(VENV)/.synced
MANIFESTS := uv.lock pyproject.toml deploy/find_python.sh deploy/install_uv.py $(wildcard */pyproject.toml */*/pyproject.toml)
UV := UV_PROJECT_ENVIRONMENT=$(VENV) UV_PYTHON_DOWNLOADS=never $(RUN)/uv

# Their processes have deadlines to meet: one stack at a time, nothing of ours beside it, and before
# the rest of the machine. Without the right to that, nice warns and runs them all the same.
WHOLE_STACKS := deploy/demo/tests $(addprefix tests/,bench end_to_end faults fuzz hosts)
BEFORE_OTHERS := nice -n -10
# Of these `make test` runs what everything else stands on; `make test-long` runs the rest, the
# studies and figures of the laboratory, and the tests that are marked as long.
SHORT_STACKS := tests/end_to_end/test_whole_stack.py tests/fuzz
IN_PARALLEL := -n auto --maxprocesses 4 --dist loadfile

export OMP_NUM_THREADS ?= 1

.DEFAULT_GOAL := help
.PHONY: help setup demo test test-long lint bench safety peers docs test-browser pictures schemas manifests fuzz test-containers clean

help: ## list the targets
	@sed -n 's/^\([a-z-]*\):[^#]*## \(.*\)/  make \1|\2/p' Makefile | \
	  while IFS='|' read -r name what; do printf '%-24s %s\n' "$$name" "$$what"; done

setup: $(READY) ## make .venv from the lock file

demo: $(READY) ## teach the demo task, run the whole stack on held-out human motion, write a report
	@$(RUN)/hmcs demo $(if $(OUTPUT),--output $(OUTPUT))

test: $(READY) ## units, contracts, types and imports, then one whole stack, also under hostile messages
	@$(RUN)/python -m pytest $(IN_PARALLEL) \
	    -m "not containers and not browser and not long" \
	    $(addprefix --ignore=,$(WHOLE_STACKS)) || failed=1; \
	  $(BEFORE_OTHERS) $(RUN)/python -m pytest $(SHORT_STACKS) || failed=1; exit $${failed:-0}

test-long: $(READY) ## the other whole stacks (faults, several hosts, every recognizer), the laboratory, long tests; 20 minutes
	@$(RUN)/python -m pytest $(IN_PARALLEL) -m long $(addprefix --ignore=,$(WHOLE_STACKS)) || failed=1; \
	  $(BEFORE_OTHERS) $(RUN)/python -m pytest $(filter-out $(SHORT_STACKS),$(WHOLE_STACKS)) \
	    $(addprefix --ignore=,$(SHORT_STACKS)) || failed=1; exit $${failed:-0}

lint: $(READY) ## put the code in the house's format and name what is left to mend
	@$(RUN)/ruff format .
	@$(RUN)/ruff check --fix .
	@$(RUN)/python -m pytest -q tests/test_house.py

bench: $(READY) ## measure speed and recognition in full, each against its goal; some fifteen minutes
	@PYTHONPATH=tests $(RUN)/python -m bench

safety: $(READY) ## measure what keeps the robot safe, a thousand faults among it; some three hours
	@for what in regions gap tls memory ros2 faults "faults --hogs 8"; do \
	  PYTHONPATH=tests $(RUN)/python -m safety $$what || failed=1; done; exit $${failed:-0}

peers: $(READY) ## install the libraries that studies compare with, beside the rest
	@$(UV) sync --frozen --quiet --group peers --python $(RUN)/python

docs: $(READY) ## build the documents and the API as a site, out/docs/index.html, and check its links
	@$(UV) sync --frozen --quiet --inexact --group docs --python $(RUN)/python
	@$(RUN)/python -m sphinx --quiet --fail-on-warning --keep-going --conf-dir docs/site \
	    --doctree-dir out/docs-cache . out/docs
	@$(RUN)/python docs/site/links.py out/docs

test-browser: $(READY) ## drive the operator's page in a chromium, with playwright installed beside the rest
	@$(UV) sync --frozen --quiet --inexact --group browser --python $(RUN)/python
	@$(BEFORE_OTHERS) $(RUN)/python -m pytest -m browser tests/browser

pictures: $(READY) ## take the pictures of the page that stand in docs/ anew, in a chromium
	@$(UV) sync --frozen --quiet --inexact --group browser --python $(RUN)/python
	@PICTURES_COARSE=1 $(RUN)/python -m pytest -q -m browser tests/browser/test_pictures.py
	@cp out/browser/page.png out/browser/page-plots.png out/browser/page-teach.png \
	  out/browser/page-recordings.png docs/

schemas: $(READY) ## rewrite JSON Schemas, golden bytes and the page of all messages
	@$(RUN)/python -m hmcs.bus.schemas tests/contract
	@$(RUN)/python -m hmcs.bus.contract_page docs/contract.md

manifests: $(READY) ## rewrite the Kubernetes manifests from compose.yaml
	@$(RUN)/python -m hmcs_local.kubernetes compose.yaml deploy/kubernetes/hmcs.yaml

fuzz: $(READY) ## a million hostile messages and ten thousand questions at the stack; about an hour
	@PYTHONPATH=tests $(RUN)/python -m fuzz

test-containers: $(READY) ## build the images and run the stack in a Docker engine
	@$(RUN)/python -m pytest -m containers tests/containers

clean: ## remove .venv, reports, the site and caches
	rm -rf $(VENV) .venv-3.13 out dist docs/api .pytest_cache .mypy_cache .ruff_cache .hypothesis .import_linter_cache
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

# A Python that is named is compared with that of the environment, at every call.
ifneq ($(filter-out auto,$(PYTHON)),)
.PHONY: $(READY)
endif

# An environment of another Python, or moved from another folder, is made anew.
$(READY): $(MANIFESTS)
	@set -e; \
	version() { "$$1" -c 'import sys; print("%d.%d" % sys.version_info[:2])' 2>/dev/null || true; }; \
	has=$$(version $(RUN)/python); \
	case $$has in 3.11 | 3.12 | 3.13) ;; *) has=none ;; esac; \
	if [ $$has = none ] || [ -n "$(filter-out auto,$(PYTHON))" ]; then \
	  python=$$(sh deploy/find_python.sh $(if $(PYTHON),"$(PYTHON)")); \
	  [ "$$has" = "$$(version "$$python")" ] || has=none; \
	fi; \
	if [ $$has = none ]; then \
	  rm -rf $(VENV); \
	  if ! "$$python" -m venv $(VENV); then \
	    rm -rf $(VENV); \
	    echo "$$python cannot make an environment: install its venv module (Debian: apt install python3-venv)" >&2; \
	    exit 1; \
	  fi; \
	fi; \
	$(RUN)/python -m pip --version >/dev/null 2>&1 || $(RUN)/python -m ensurepip >/dev/null; \
	$(RUN)/python deploy/install_uv.py; \
	$(UV) sync --frozen --quiet --python $(RUN)/python; \
	touch $@
