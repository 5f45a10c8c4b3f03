# Every target sets up what it needs. PYTHON=... picks the interpreter for a new .venv.
VENV := .venv
PY := $(VENV)/bin/python
STAMP := $(VENV)/.installed
export PYTHONPATH := $(CURDIR)
export OMT_UV_MODELS ?= $(CURDIR)/../shared/models

.PHONY: demo test check bench papers extension matrix gui repository site venv clean

# Two processes at once, each file in one of them, in the order of tests/conftest.py, and no threads of BLAS that would
# spin beside the other's. What Python compiles is kept: hundreds of tests begin processes of their own.
test: $(STAMP)
	env -u PYTHONDONTWRITEBYTECODE PYTHONPYCACHEPREFIX=$(CURDIR)/build/compiled \
	    OMP_NUM_THREADS=$${OMP_NUM_THREADS:-1} $(PY) -m pytest -n 2 --dist loadfile --no-loadscope-reorder

demo: $(STAMP)
	$(PY) scripts/pictures/demo.py

check: $(STAMP)
	$(PY) -m ruff check .
	$(PY) -m ruff format --check .
	$(PY) -m mypy
	$(PY) scripts/release/site.py

papers: $(STAMP)
	$(PY) scripts/papers/zhao_2013.py
	$(PY) scripts/papers/su_2015.py
	$(PY) scripts/papers/su_registration.py
	$(PY) scripts/papers/dominitz_tannenbaum_2010.py
	$(PY) scripts/papers/gu_2018.py
	$(PY) scripts/papers/hu_2014.py

bench: $(STAMP)
	$(PY) benchmarks/run.py

extension: $(STAMP)
	$(PY) scripts/release/build_extension.py

matrix: $(STAMP)
	$(PY) scripts/release/matrix.py

# Makes roots of later Debians where it may, and plays in whatever is there; OMT_UV_GUI_AGES=here plays in this one's.
gui: $(STAMP)
	@[ "$${OMT_UV_GUI_AGES:-all}" = here ] || $(PY) scripts/gui/ages.py || true
	OMT_UV_GUI=1 $(PY) -m pytest -rs tests/gui

repository: $(STAMP)
	$(PY) scripts/release/repository.py

site: $(STAMP)
	$(PY) scripts/release/site.py

venv: $(STAMP)

$(STAMP): requirements.txt requirements-dev.txt
	@$(PY) -c "" 2>/dev/null || { \
	    python="$(PYTHON)"; \
	    [ -n "$$python" ] || python=$$(scripts/release/find_python.sh) || exit 1; \
	    echo "Setting up $(VENV) with $$python"; \
	    "$$python" -m venv --clear $(VENV); }
	$(PY) -m pip install --quiet --disable-pip-version-check -r requirements-dev.txt
	@touch $@

clean:
	rm -rf build dist .pytest_cache .ruff_cache .mypy_cache
