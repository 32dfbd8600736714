# make demo     Queen walks: installs everything, prints an episode's return, leaves out/queen.png and out/queen.mp4
# make check    lint and the fast tests: after every edit
# make test     installs everything, runs the tests, on all cores
# make lint     ruff, the contracts of imports, and the schemas of workflows
# make docs     builds the documentation site in out/docs/html; with Node, creatures walk there
# make media    draws the pictures and films of creatures in README and docs; needs Node and Chromium; half an hour
# make notebooks  runs the notebooks of examples, and keeps their pictures and tables in them; minutes
# make web      bundles the scripts that pages are made of, three.js and MuJoCo's WebAssembly; needs Node
# make dist     builds wheel and source distribution in dist/, with the viewer of pages; needs Node
# make bench    measures speed, writes studies/performance.md and a plot; minutes, on a quiet machine
# make bench-gpu  measures worlds on this machine's GPU, writes its table into docs/gpu.md
# make golden   shows how golden numbers and digests differ; tests/golden.py --accept and tests/digests.py --accept store new ones
# make clean    deletes environments and what is built
# make check-NAME, of the table below; most have an environment of their own, so that heavy packages stay out of .venv:
#   long, release       tests that take long, and those for a release: half an hour
#   editor              programs of pages, by mypy and pyright: what users' editors show; needs Node
#   types, lowest       annotations, by mypy; the environments with the oldest Gymnasium that setup.cfg admits
#   agents, agents-release, jax, mjx, mjx-release    learners, tasks and worlds on JAX, on a processor
#   sb3, clients        stable-baselines3 and our scripts for it; the clients of docs/clients.md: gigabytes
#   first-steps         six roads of newcomers, each to its end, by the commands of the pages; two hours
#   docs, notebooks     links of the site, its front page in Chromium; the notebooks of examples
#   web, play, studio   pages in Chromium and Node, played by keys and pointers; the studio, its sliders and its gate
#   glb, blender, godot clips in Khronos' validator and three programs that open them
#   robots, robots-release    robots of others, in wheels (320 MB): they come in, with the same bits, and walk, in minutes;
#                       in all tasks, by all presets, in hours
#   bodies, survey, following, directing, leaps, clip-sets    many bodies: bit-equality, walks, commands, clips; half an hour to two
#   soak, fuzz, loopholes, mutants    memory over two million steps; damaged files; policies that cheat; planted mistakes (hours)
#   absurd              ten thousand absurd values of settings: each is refused, or has an effect; minutes

SHELL := /bin/bash
# Tests start some hundred programs; without bytecode each compiles the package anew.
unexport PYTHONDONTWRITEBYTECODE
VENV ?= .venv
PYTHON = $(VENV)/bin/python
INSTALLED := $(VENV)/installed

.PHONY: demo test check lint docs media notebooks web dist bench bench-gpu golden clean

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

check: lint $(INSTALLED)
	tools/ensure_egl.sh $(PYTHON)
	$(PYTHON) -m pytest $(PARALLEL) -m "not slow and not long and not release"

lint: $(INSTALLED)
	$(VENV)/bin/ruff check .
	$(VENV)/bin/ruff format --check .
	$(PYTHON) tools/plainness.py
	$(VENV)/bin/lint-imports --no-cache --no-logo
	$(VENV)/bin/check-jsonschema --builtin-schema vendor.github-workflows .github/workflows/*.yml
	$(VENV)/bin/check-jsonschema --builtin-schema vendor.citation-file-format CITATION.cff

$(VENV)/demo: setup.cfg pyproject.toml tools/ensure_venv.sh
	tools/ensure_venv.sh $(VENV)
	$(PYTHON) -m pip install -q -e '.[video]'
	touch $@

$(INSTALLED): setup.cfg pyproject.toml tools/ensure_venv.sh
	tools/ensure_venv.sh $(VENV)
	$(PYTHON) -m pip install -q -e '.[dev]'
	touch $@

# Warnings are errors. Without Node the site has pictures in place of walking creatures.
docs: VENV := .venv-docs
docs: setup.cfg
	tools/ensure_venv.sh $(VENV)
	$(VENV)/bin/python -m pip install -q -e '.[docs]'
	$(MAKE) web || true
	$(VENV)/bin/python tools/make_site.py out/docs
	$(VENV)/bin/python -m sphinx -q -W --keep-going -j auto -c docs out/docs/sources out/docs/html

# A cut of README's film is a page, in Chromium.
media: VENV := .venv-web
media: $(VIEWER)
	tools/ensure_venv.sh $(VENV)
	$(VENV)/bin/python -m pip install -q -e '.[dev]' playwright==1.65.2
	tools/ensure_egl.sh $(VENV)/bin/python
	command -v chromium google-chrome >/dev/null || tools/ensure_packages.sh chromium
	$(VENV)/bin/python tools/make_media.py

notebooks: VENV := .venv-notebooks
notebooks: setup.cfg
	tools/ensure_venv.sh $(VENV)
	tools/ensure_egl.sh $(PYTHON)
	$(PYTHON) -m pip install -q -e '.[learn,video]' 'nbclient>=0.10' 'ipykernel>=7'
	$(PYTHON) tools/run_notebooks.py

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

bench-gpu: VENV := .venv-mjx
bench-gpu: setup.cfg
	tools/ensure_venv.sh $(VENV)
	$(VENV)/bin/python -m pip install -q -e '.[learn,gpu]' 'jax[cuda12]>=0.10'
	$(VENV)/bin/python tools/bench_gpu.py --document docs/gpu.md

bench: $(INSTALLED)
	$(PYTHON) tools/bench.py --plot docs/performance.png --document studies/performance.md

golden: $(INSTALLED)
	$(PYTHON) tests/golden.py
	$(PYTHON) tests/digests.py

# Checks: `make check-NAME`. A row says the environment, extras, packages and programs of Debian, and what runs.
PYTEST = $(VENV)/bin/python -m pytest
ENGINES := out/engines
FAST := -m "not slow and not long and not release"

check-%: EXTRAS := dev
check-%: setup.cfg
	tools/ensure_venv.sh $(VENV)
	$(if $(FIRST),$(VENV)/bin/python -m pip install -q $(FIRST))
	$(VENV)/bin/python -m pip install -q -e '.[$(EXTRAS)]' $(PACKAGES)
	tools/ensure_egl.sh $(VENV)/bin/python
	$(foreach name,$(DEBIAN),command -v $(name) $(INSTEAD) >/dev/null || tools/ensure_packages.sh $(name);)
	$(RUN)

check-long: RUN = $(PYTEST) $(PARALLEL) -m "long and not release"
check-release: RUN = $(PYTEST) $(PARALLEL) -m release

check-types: VENV := .venv-types
check-types: PACKAGES := mypy==2.4.1
check-types: RUN = $(VENV)/bin/mypy

# The environment of README's install line.
check-editor: VENV := .venv-editor
check-editor: EXTRAS := learn,animate
check-editor: PACKAGES := pytest mypy==2.4.1
check-editor: RUN = npm install --prefix .node-editor --no-audit --no-fund --silent pyright@1.1.414 && \
	PATH=$(CURDIR)/.node-editor/node_modules/.bin:$$PATH $(PYTEST) tests/house/test_editor_types.py

check-lowest: VENV := .venv-lowest
check-lowest: PACKAGES := gymnasium==1.2.0
check-lowest: RUN = $(PYTEST) $(PARALLEL) $(FAST) tests/envs tests/data/test_collection.py tests/data/test_dataset.py \
	tests/tasks/test_conformance.py tests/simulation/test_divergence.py tests/house/test_threads.py tests/house/test_errors.py

# torch comes first, so that stable-baselines3 keeps it. Where the default build is one for GPUs, a CPU
# build is had with PIP_EXTRA_INDEX_URL set to PyTorch's CPU index and TORCH=torch==2.13.0+cpu.
TORCH ?= torch==2.13.0
check-sb3: VENV := .venv-sb3
check-sb3: FIRST = '$(TORCH)'
check-sb3: EXTRAS := sb3
check-sb3: PACKAGES := pytest matplotlib sbx-rl==0.28.0 rsl-rl-lib==5.5.1
check-sb3: RUN = $(VENV)/bin/python tools/check_sb3.py --steps 500 && \
	$(PYTEST) tests/envs/test_sb3.py tests/policies/test_sb3_file.py tests/examples tests/house/test_coming_from.py

check-clients: RUN = $(PYTHON) tools/check_clients.py

# The extras of README's install line, and what runs ONNX.
check-first-steps: VENV := .venv-first-steps
check-first-steps: EXTRAS := learn,animate
check-first-steps: PACKAGES := onnxruntime
check-first-steps: RUN = $(PYTHON) tools/check_first_steps.py

check-docs: docs
check-docs: VENV := .venv-docs
check-docs: EXTRAS := docs
check-docs: PACKAGES := pytest playwright==1.65.2
check-docs: RUN = $(PYTEST) tests/website

check-notebooks: VENV := .venv-notebooks
check-notebooks: EXTRAS := learn,video
# nbmake runs the cells of notebooks in pytest, with this kernel.
check-notebooks: PACKAGES := pytest 'nbmake>=1.5' 'ipykernel>=7'
check-notebooks: RUN = $(PYTEST) --nbmake --nbmake-timeout=600 -p no:cacheprovider -p no:xdist -c /dev/null --rootdir=. \
	examples/notebooks

check-web check-play check-studio: $(VIEWER)
check-web check-play check-studio: VENV := .venv-web
check-web check-play check-studio: PACKAGES := playwright==1.65.2
check-web check-play check-studio: DEBIAN := chromium
check-web check-play check-studio: INSTEAD := google-chrome
check-web: RUN = $(PYTEST) tests/animation/test_pages.py && \
	$(VENV)/bin/python tests/engines/make_files.py $(ENGINES) few && \
	NODE_PATH=$(CURDIR)/.node-web/node_modules .node-web/node_modules/.bin/esbuild tests/engines/loader.js --bundle \
		--outfile=$(ENGINES)/loader.js --log-level=warning && \
	$(VENV)/bin/python tests/engines/three.py $(ENGINES) $(ENGINES)/loader.js
check-play: RUN = $(PYTEST) tests/animation/test_play_pages.py tests/animation/test_play_in_browser.py
check-studio: VENV := .venv-studio
check-studio: EXTRAS := dev,animate
check-studio: RUN = $(PYTEST) tests/animation/studio

check-glb: RUN = mkdir -p .node-glb && cp tests/engines/package.json tests/engines/package-lock.json .node-glb/ && \
	npm ci --prefix .node-glb --no-audit --no-fund --silent && \
	$(PYTHON) tests/engines/make_files.py $(ENGINES) && \
	NODE_PATH=.node-glb/node_modules node tests/engines/validate.js $(ENGINES)

# Blender's wheels are each for one version of Python: of 5.0, 3.11.
check-blender: RUN = tools/ensure_venv.sh .venv-blender && .venv-blender/bin/python -m pip install -q bpy==5.0.1 && \
	$(PYTHON) tests/engines/make_files.py $(ENGINES) bones && .venv-blender/bin/python tests/engines/blender.py $(ENGINES)

check-godot: DEBIAN := godot3-server
check-godot: RUN = tools/ensure_venv.sh .venv-godot && .venv-godot/bin/python -m pip install -q gdtoolkit==4.5.0 && \
	.venv-godot/bin/gdlint examples/godot && .venv-godot/bin/gdformat --check examples/godot && \
	$(PYTHON) tests/engines/make_files.py $(ENGINES) few && $(PYTHON) tests/engines/godot.py $(ENGINES)

check-jax: VENV := .venv-jax
check-jax: EXTRAS := dev,learn
check-jax: RUN = $(PYTEST) tests/tasks/test_jax.py

# Compiled functions are kept, and Brax and MuJoCo Playground are there for their wrappers and trainers.
check-mjx check-mjx-release: VENV := .venv-mjx
check-mjx check-mjx-release: EXTRAS := dev,learn,gpu
check-mjx check-mjx-release: PACKAGES := playground==0.2.0 brax==0.14.2
check-mjx check-mjx-release: RUN = JAX_COMPILATION_CACHE_DIR=$(VENV)/compiled $(PYTEST) -m "$(MARKS)" tests/mjx
check-mjx: MARKS := not release
check-mjx-release: MARKS := release

# Compiled functions are kept for other processes and later runs; programs of tests run in folders of their own.
COMPILED = JAX_COMPILATION_CACHE_DIR='$(CURDIR)/$(VENV)/compiled' JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS=0.2
# pandas before 3, as what rliable needs does not know it yet.
check-agents check-agents-release: VENV := .venv-jax
check-agents check-agents-release: EXTRAS := dev,learn
check-agents check-agents-release: PACKAGES := onnxruntime rliable 'pandas<3' optuna==5.0.0
check-agents check-agents-release: RUN = $(COMPILED) $(PYTEST) $(PARALLEL) -m "$(MARKS)" tests/learning/agents \
	tests/learning/studies/test_study.py tests/learning/cli/test_train.py tests/learning/test_onnx_file.py \
	tests/learning/test_runner.py tests/learning/test_sim_to_sim.py tests/evaluation/test_statistics.py \
	tests/learning/test_cards.py tests/learning/test_trackers.py tests/examples/test_tracker_scripts.py
check-agents: MARKS := not long and not release
check-agents-release: MARKS := long or release

check-bodies: RUN = $(PYTEST) $(PARALLEL) tests/bodies/test_environments.py tests/bodies/test_families.py && \
	$(PYTHON) tools/survey.py --family varied --count 120
check-robots check-robots-release: RUN = $(PYTHON) tests/robots_of_others/zoo.py out/robots && \
	$(PYTHON) tests/robots_of_others/check.py out/robots $(TASKS)
check-robots-release: TASKS := --tasks
check-survey: RUN = $(PYTHON) tools/survey.py --count 500
check-following: RUN = $(PYTHON) tests/following.py
check-directing: RUN = $(PYTHON) tests/directing.py
check-leaps: RUN = $(PYTHON) tests/leaps.py
check-clip-sets: RUN = $(PYTHON) tests/clip_sets.py
check-soak: RUN = $(PYTHON) tests/soak.py
check-loopholes: RUN = $(PYTHON) tests/loopholes.py
check-fuzz: RUN = $(PYTHON) tests/fuzz.py
check-absurd: RUN = $(PYTHON) tests/absurd.py
check-mutants: RUN = $(PYTHON) tests/mutants.py

clean:
	rm -rf .venv .venv-* .node-* out build dist *.egg-info
