# make demo    Queen walks: installs everything, prints an episode's return, leaves out/queen.png and out/queen.mp4
# make check   lint and the fast tests: after every edit
# make test    installs everything, runs the tests, on all cores
# make check-long  tests that take long
# make check-release  further cases of tests that have many, and tests that take minutes: half an hour, before a release
# make check-types  type annotations of the public modules, by mypy in an environment of its own
# make check-lowest  tests of the environments with the oldest Gymnasium that setup.cfg admits, in an environment of its own
# make check-sb3  stable-baselines3: its checker, a short SAC run, our rows for it, training scripts; in an environment of their own
# make check-clients  runs docs/clients.md, each client in an environment of its own; gigabytes
# make dist    builds wheel and source distribution in dist/, with the viewer of pages; needs Node
# make docs    builds the documentation site in out/docs/html, in an environment of its own; with Node, creatures walk there
# make media   draws the pictures and films of creatures in README and docs; minutes
# make check-docs  builds the site, follows its links and looks at its front page in Chromium
# make check-notebooks  runs the notebooks of examples, in an environment of its own
# make web     bundles the scripts that pages are made of, three.js and MuJoCo's WebAssembly; needs Node
# make check-web  plays pages in Chromium and opens clips there with three.js, in an environment of its own
# make check-studio  the studio in Chromium: sliders moved, creature changed, command followed, files saved
# make check-play  walks bodies of pages in Node against Python, and plays pages in Chromium by keys and pointers
# make check-glb  Khronos' validator on the clips of the robots, the examples and 100 random bodies; needs Node
# make check-blender, check-godot  open clips of the robots in Blender, in an environment of its own, and in Debian's Godot 3; the sample project is linted
# make check-jax  tasks under jax.jit and jax.vmap, in an environment of their own
# make check-agents  learners, ONNX and statistics against reference implementations, in the environment of check-jax
# make check-agents-release  the same for every algorithm, and for studies that are killed
# make check-bodies  environments of different bodies of every layout, task and autoreset mode, and a census of varied ones; minutes
# make check-mjx  worlds on MJX and MuJoCo Warp, on a processor, in an environment of their own; minutes
# make bench-gpu  measures worlds on this machine's GPU, writes its table into docs/gpu.md
# make bench   measures speed, writes docs/performance.md and its plot; minutes, on a quiet machine
# make survey  walks 500 random bodies and tells which do
# make obedience  how well 100 random bodies follow ten commands; minutes
# make clip-sets  loops, connections and slip of the clips of 110 bodies; half an hour
# make soak    two million steps: memory, threads and files stay what they are
# make loopholes  searches for policies that earn reward and fail at a task; some ten minutes
# make fuzz    damages specs, tracks and datasets at random and reads them; minutes
# make mutants plants mistakes and tells which test catches each; takes hours
# make golden  shows how golden numbers and digests differ; tests/golden.py --accept and tests/digests.py --accept store new ones
SHELL := /bin/bash
# Tests start some hundred programs; without bytecode each compiles the package anew.
unexport PYTHONDONTWRITEBYTECODE
VENV ?= .venv
PYTHON := $(VENV)/bin/python
INSTALLED := $(VENV)/installed

.PHONY: demo dist docs media check-notebooks test check check-long check-release lint check-types check-lowest check-sb3 check-clients web check-web check-docs check-play check-studio check-glb check-blender check-godot check-jax check-mjx check-mjx-release check-agents check-agents-release check-bodies bench bench-gpu survey obedience soak loopholes fuzz mutants golden clean clip-sets

demo: $(VENV)/demo
	tools/ensure_egl.sh $(PYTHON)
	mkdir -p out
	$(VENV)/bin/arc-suite evaluate --robot queen --policy cpg --episodes 1
	$(VENV)/bin/arc-suite render --robot queen --policy cpg --output out/queen.png
	$(VENV)/bin/arc-suite render --robot queen --policy cpg --output out/queen.mp4

# Tests run in as many processes as there are cores. An idle process takes tests from the others.
PARALLEL := -n auto --dist worksteal

test: $(INSTALLED)
	tools/ensure_egl.sh $(PYTHON)
	$(PYTHON) -m pytest $(PARALLEL) -m "not long and not release"

check-long: $(INSTALLED)
	tools/ensure_egl.sh $(PYTHON)
	$(PYTHON) -m pytest $(PARALLEL) -m "long and not release"

check-release: $(INSTALLED)
	tools/ensure_egl.sh $(PYTHON)
	$(PYTHON) -m pytest $(PARALLEL) -m release

check: lint $(INSTALLED)
	tools/ensure_egl.sh $(PYTHON)
	$(PYTHON) -m pytest $(PARALLEL) -m "not slow and not long and not release"

lint: $(VENV)/linter
	$(VENV)/bin/ruff check .
	$(VENV)/bin/ruff format --check .
	$(VENV)/bin/lint-imports --no-cache --no-logo
	$(VENV)/bin/check-jsonschema --builtin-schema vendor.github-workflows .github/workflows/*.yml
	$(VENV)/bin/check-jsonschema --builtin-schema vendor.citation-file-format CITATION.cff

$(VENV)/demo: setup.cfg pyproject.toml tools/ensure_venv.sh
	tools/ensure_venv.sh $(VENV)
	$(PYTHON) -m pip install -q -e '.[video]'
	touch $@

$(INSTALLED): setup.cfg pyproject.toml tools/ensure_venv.sh
	tools/ensure_venv.sh $(VENV)
	$(PYTHON) -m pip install -q -e '.[test]'
	touch $@

$(VENV)/linter: $(INSTALLED)
	$(PYTHON) -m pip install -q -e '.[lint]'
	touch $@

check-types: VENV := .venv-types
check-types: setup.cfg
	tools/ensure_venv.sh $(VENV)
	$(VENV)/bin/python -m pip install -q -e '.[test]' mypy==2.4.1
	$(VENV)/bin/mypy

check-lowest: VENV := .venv-lowest
check-lowest: setup.cfg
	tools/ensure_venv.sh $(VENV)
	tools/ensure_egl.sh $(VENV)/bin/python
	$(VENV)/bin/python -m pip install -q -e '.[test]' 'gymnasium==1.2.0'
	$(VENV)/bin/python -m pytest $(PARALLEL) -m "not slow and not long and not release" tests/envs tests/data/test_collection.py tests/data/test_dataset.py \
		tests/tasks/test_conformance.py tests/simulation/test_divergence.py tests/house/test_threads.py \
		tests/house/test_errors.py

# torch comes first, so that stable-baselines3 keeps it. Where the default build is one for GPUs, a CPU
# build is had with PIP_EXTRA_INDEX_URL set to PyTorch's CPU index and TORCH=torch==2.13.0+cpu.
TORCH ?= torch==2.13.0
check-sb3: VENV := .venv-sb3
check-sb3: setup.cfg
	tools/ensure_venv.sh $(VENV)
	$(VENV)/bin/python -m pip install -q '$(TORCH)'
	$(VENV)/bin/python -m pip install -q -e '.[sb3]' pytest matplotlib 'sbx-rl==0.28.0'
	$(VENV)/bin/python tools/check_sb3.py --steps 500
	$(VENV)/bin/python -m pytest tests/envs/test_sb3.py tests/policies/test_sb3_file.py tests/examples

check-clients: $(INSTALLED)
	tools/ensure_egl.sh $(PYTHON)
	$(PYTHON) tools/check_clients.py

# Warnings are errors. Without Node the site has pictures in place of walking creatures.
docs: VENV := .venv-docs
docs: setup.cfg
	tools/ensure_venv.sh $(VENV)
	$(VENV)/bin/python -m pip install -q -e '.[docs]'
	$(MAKE) web || true
	$(VENV)/bin/python tools/make_site.py out/docs
	$(VENV)/bin/python -m sphinx -q -W --keep-going -j auto -c docs out/docs/sources out/docs/html

media: $(INSTALLED)
	tools/ensure_egl.sh $(PYTHON)
	$(PYTHON) tools/make_media.py

check-docs: VENV := .venv-docs
check-docs: docs
	$(VENV)/bin/python -m pip install -q pytest playwright==1.65.2
	$(VENV)/bin/python -m pytest tests/website

check-notebooks: VENV := .venv-notebooks
check-notebooks: setup.cfg
	tools/ensure_venv.sh $(VENV)
	tools/ensure_egl.sh $(VENV)/bin/python
	$(VENV)/bin/python -m pip install -q -e '.[notebooks]'
	$(VENV)/bin/python -m pytest --nbmake --nbmake-timeout=600 -p no:cacheprovider -p no:xdist -c /dev/null --rootdir=. examples/notebooks

ENGINES := out/engines

# What it makes is not committed, and goes into wheels.
VIEWER := arc_suite/animation/web/mujoco.wasm.zlib
web: $(VIEWER)
$(VIEWER): $(wildcard web/*)
	mkdir -p .node-web $(dir $@)
	cp web/package.json web/package-lock.json .node-web/
	npm ci --prefix .node-web --no-audit --no-fund --silent
	NODE_PATH=$(CURDIR)/.node-web/node_modules node web/build.js $(dir $@)

# Other builds go on without the viewer; what is to be released has it.
dist: VENV := .venv-dist
dist: $(VIEWER)
	tools/ensure_venv.sh $(VENV)
	$(VENV)/bin/python -m pip install -q build
	rm -rf dist
	$(VENV)/bin/python -m build --outdir dist .

check-web: VENV := .venv-web
check-web: setup.cfg $(VIEWER)
	tools/ensure_venv.sh $(VENV)
	command -v chromium google-chrome >/dev/null || tools/ensure_packages.sh chromium
	$(VENV)/bin/python -m pip install -q -e '.[test]' playwright==1.65.2
	$(VENV)/bin/python -m pytest tests/animation/test_pages.py
	$(VENV)/bin/python tests/engines/make_files.py $(ENGINES) few
	NODE_PATH=$(CURDIR)/.node-web/node_modules .node-web/node_modules/.bin/esbuild tests/engines/loader.js --bundle \
		--outfile=$(ENGINES)/loader.js --log-level=warning
	$(VENV)/bin/python tests/engines/three.py $(ENGINES) $(ENGINES)/loader.js

check-studio: VENV := .venv-studio
check-studio: setup.cfg $(VIEWER)
	tools/ensure_venv.sh $(VENV)
	tools/ensure_egl.sh $(VENV)/bin/python
	command -v chromium google-chrome >/dev/null || tools/ensure_packages.sh chromium
	$(VENV)/bin/python -m pip install -q -e '.[test,studio]' playwright==1.65.2
	$(VENV)/bin/python -m pytest tests/animation/studio

check-play: VENV := .venv-web
check-play: setup.cfg $(VIEWER)
	tools/ensure_venv.sh $(VENV)
	command -v chromium google-chrome >/dev/null || tools/ensure_packages.sh chromium
	$(VENV)/bin/python -m pip install -q -e '.[test]' playwright==1.65.2
	$(VENV)/bin/python -m pytest tests/animation/test_play.py tests/animation/test_play_page.py

check-glb: $(INSTALLED)
	mkdir -p .node-glb
	cp tests/engines/package.json tests/engines/package-lock.json .node-glb/
	npm ci --prefix .node-glb --no-audit --no-fund --silent
	$(PYTHON) tests/engines/make_files.py $(ENGINES)
	NODE_PATH=.node-glb/node_modules node tests/engines/validate.js $(ENGINES)

# Blender's wheels are each for one version of Python: of 5.0, 3.11.
check-blender: $(INSTALLED)
	tools/ensure_venv.sh .venv-blender
	.venv-blender/bin/python -m pip install -q bpy==5.0.1
	$(PYTHON) tests/engines/make_files.py $(ENGINES) few
	.venv-blender/bin/python tests/engines/blender.py $(ENGINES)

check-godot: $(INSTALLED)
	tools/ensure_venv.sh .venv-godot
	.venv-godot/bin/python -m pip install -q gdtoolkit==4.5.0
	.venv-godot/bin/gdlint examples/godot
	.venv-godot/bin/gdformat --check examples/godot
	command -v godot3-server >/dev/null || tools/ensure_packages.sh godot3-server
	$(PYTHON) tests/engines/make_files.py $(ENGINES) few
	$(PYTHON) tests/engines/godot.py $(ENGINES)

check-jax: VENV := .venv-jax
check-jax: setup.cfg
	tools/ensure_venv.sh $(VENV)
	$(VENV)/bin/python -m pip install -q -e '.[test,jax]'
	$(VENV)/bin/python -m pytest tests/tasks/test_jax.py

# Compiled functions are kept, and Brax and MuJoCo Playground are there for their wrappers and trainers.
check-mjx check-mjx-release bench-gpu: VENV := .venv-mjx
check-mjx: MARKS := not release
check-mjx-release: MARKS := release
check-mjx check-mjx-release: setup.cfg
	tools/ensure_venv.sh $(VENV)
	$(VENV)/bin/python -m pip install -q -e '.[test,agents,mjx-warp]' playground==0.2.0 brax==0.14.2
	JAX_COMPILATION_CACHE_DIR=$(VENV)/compiled $(VENV)/bin/python -m pytest -m "$(MARKS)" tests/mjx

# pandas before 3, as what rliable needs does not know it yet.
check-agents check-agents-release: VENV := .venv-jax
check-agents: MARKS := not long and not release
check-agents-release: MARKS := long or release
check-agents check-agents-release: setup.cfg
	tools/ensure_venv.sh $(VENV)
	$(VENV)/bin/python -m pip install -q -e '.[test,agents,cluster,onnx,tensorboard]' onnxruntime rliable 'pandas<3'
	$(VENV)/bin/python -m pytest $(PARALLEL) -m "$(MARKS)" tests/learning/agents tests/learning/studies/test_study.py tests/learning/cli/test_train.py \
		tests/policies/test_onnx_file.py tests/evaluation/test_statistics.py

check-bodies: $(INSTALLED)
	tools/ensure_egl.sh $(PYTHON)
	$(PYTHON) -m pytest $(PARALLEL) tests/envs/test_bodies.py tests/models/test_families.py
	$(VENV)/bin/arc-suite survey --family varied --count 120

bench-gpu: setup.cfg
	tools/ensure_venv.sh $(VENV)
	$(VENV)/bin/python -m pip install -q -e '.[agents,mjx-warp]' 'jax[cuda12]>=0.10'
	$(VENV)/bin/python tools/bench_gpu.py --document docs/gpu.md

bench: $(INSTALLED)
	$(PYTHON) tools/bench.py --plot docs/performance.png --document docs/performance.md

survey: $(INSTALLED)
	$(VENV)/bin/arc-suite survey --count 500

obedience: $(INSTALLED)
	$(PYTHON) tests/obedience.py

clip-sets: $(INSTALLED)
	$(PYTHON) tests/clip_sets.py

soak: $(INSTALLED)
	$(PYTHON) tests/soak.py

loopholes: $(INSTALLED)
	$(PYTHON) tests/loopholes.py

fuzz: $(INSTALLED)
	$(PYTHON) tests/fuzz.py

mutants: $(INSTALLED)
	$(PYTHON) tests/mutants.py

golden: $(INSTALLED)
	$(PYTHON) tests/golden.py
	$(PYTHON) tests/digests.py

clean:
	rm -rf .venv .venv-* .node-* out build dist *.egg-info
