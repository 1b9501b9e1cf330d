# Surface mesh + recipe -> archetype -> run -> pictures and film. `make -f pipeline.mk help` lists the targets.
#
# An artist drops ASSETS/bodies/NAME.body.toml (and its mesh) and ASSETS/scenes/NAME.scene.toml: wildcards find them.
# Another makefile may set ASSETS and OUT, then include this file; nothing here depends on the current folder.

ARCHETIDE_SELF := $(lastword $(MAKEFILE_LIST))
ARCHETIDE_ROOT := $(patsubst ./%,%,$(dir $(ARCHETIDE_SELF)))

ASSETS ?= $(ARCHETIDE_ROOT)assets
OUT ?= $(ARCHETIDE_ROOT)out
# Extra key=value words for the runs: SETS for all of them, SETS_tub for the scene tub.
SETS ?=
# Extra options of `archetide-sim render`.
RENDER ?=
# Compile jobs and tests side by side (a core and 3 GiB of free memory each), and threads of a run (empty: all cores, shared
# among the jobs of `make -j`).
ifeq ($(origin JOBS),undefined)
JOBS := $(shell n=$$(env -u OMP_NUM_THREADS nproc); m=$$(awk '/^MemAvailable/ {print int($$2 / 3145728)}' /proc/meminfo); \
  [ "$$m" -ge "$$n" ] || n=$$m; echo $$(( n > 1 ? n : 1 )))
endif
THREADS ?=
# What goes before each program that computes: LAUNCH='srun -n1 -c8', or nice.
LAUNCH ?=
# Warnings are errors; OFF for other compilers than Debian bookworm's.
WERROR ?= ON
ARCHETYPES ?= $(OUT)/archetypes
BUILD ?= $(ARCHETIDE_ROOT)build

# A folder with a space, a quote or a dollar sign in its name cannot be one word of make and of the shell.
ARCHETIDE_QUOTE := '
archetide_folder = $(if $(or $(word 2,$($(1))),$(findstring $(ARCHETIDE_QUOTE),$($(1))),$(findstring $$,$($(1)))),$(error \
  $(1)=$($(1)): make cannot handle this folder name; choose one without spaces, quotes and dollar signs))
$(foreach folder,ASSETS OUT ARCHETYPES BUILD,$(call archetide_folder,$(folder)))

# File names become words of make and of the shell: one that holds more than letters (of any alphabet), digits and
# . _ + @ , - is refused before anything is made of it.
ARCHETIDE_RENAME := rename it to letters, digits and the characters . _ + @ , -
archetide_plain = [ "$$(printf %s $(1) | LC_ALL=C tr -d 'A-Za-z0-9._+@,\200-\377-' | wc -c)" -eq 0 ]
archetide_odd = cd '$(ASSETS)/$(1)' 2>/dev/null && for name in *.$(2).toml; do \
  [ ! -e "$$name" ] && [ ! -L "$$name" ] || $(call archetide_plain,"$$name") || \
  { printf '"%s/%s"' '$(ASSETS)/$(1)' "$$name" | tr '[:cntrl:]' '?'; echo; }; done
ARCHETIDE_ODD := $(shell $(call archetide_odd,bodies,body)) $(shell $(call archetide_odd,scenes,scene))
ifneq ($(strip $(ARCHETIDE_ODD)),)
ifneq ($(filter-out deps build check hard fuzz mutate mutations faults sanitize% long docs deb new-body clean help,$(or $(MAKECMDGOALS),pipeline)),)
$(error $(strip $(ARCHETIDE_ODD)): make cannot handle this file name; $(ARCHETIDE_RENAME))
endif
else
ARCHETIDE_BODIES := $(patsubst $(ASSETS)/bodies/%.body.toml,%,$(wildcard $(ASSETS)/bodies/*.body.toml))
ARCHETIDE_SCENES := $(patsubst $(ASSETS)/scenes/%.scene.toml,%,$(wildcard $(ASSETS)/scenes/*.scene.toml))
endif
ARCHETIDE_PRECOMPUTE := $(BUILD)/bin/archetide-precompute
ARCHETIDE_SIM := $(BUILD)/bin/archetide-sim
ARCHETIDE_STATE := $(OUT)/.state
ARCHETIDE_MAKE = $(MAKE) -f '$(ARCHETIDE_SELF)' ASSETS='$(ASSETS)' BUILD='$(BUILD)' ARCHETYPES='$(ARCHETYPES)'

.PHONY: pipeline deps build check slow nightly hard fuzz mutate mutations faults sanitize sanitize-address sanitize-thread archetide-clang long demo bodies runs report scorecard figure11 paper measurements docs deb list check-scenes new-body clean help FORCE
pipeline: bodies runs
FORCE:

# ---- Programs -------------------------------------------------------------------------------------------------------

ARCHETIDE_PACKAGES := make cmake g++ ninja-build ccache pkg-config libeigen3-dev libfmt-dev libcgal-dev libgmsh-dev \
  libarpack2-dev libsuitesparse-dev libmetis-dev libopenblas-dev libhdf5-dev libssl-dev libembree-dev \
  libtomlplusplus-dev libcli11-dev nlohmann-json3-dev libpng-dev libtbb-dev ffmpeg libgtest-dev

# What fuzz and sanitize need besides: clang has the fuzzer.
ARCHETIDE_CLANG_PACKAGES := clang libomp-dev

# Installs the Debian packages that are missing; does nothing when all are there.
deps:
	@command -v dpkg-query >/dev/null || { echo "deps: this is not Debian; install by hand:" \
	  "$(ARCHETIDE_PACKAGES)" >&2; exit 1; }; \
	missing=""; for p in $(ARCHETIDE_PACKAGES) $(ALSO); do \
	  dpkg-query -W -f '$${Status}' $$p 2>/dev/null | grep -q ' installed$$' || missing="$$missing $$p"; done; \
	[ -n "$$missing" ] || exit 0; \
	echo "deps: installing$$missing"; \
	if [ "$$(id -u)" = 0 ]; then root="env"; \
	elif command -v sudo >/dev/null; then root="sudo env"; \
	else echo "deps: run as root: apt-get install$$missing" >&2; exit 1; fi; \
	$$root DEBIAN_FRONTEND=noninteractive apt-get -q update && \
	$$root DEBIAN_FRONTEND=noninteractive apt-get -q install -y --no-install-recommends $$missing

# What a new build folder $(1) is given: the preset $(2) of CMakePresets.json.
archetide_new_folder = new=; [ -f '$(1)/CMakeCache.txt' ] || new=--preset=$(2)
define archetide_compile
@mkdir -p '$(BUILD)'; $(call archetide_new_folder,$(BUILD),fresh); \
cmake -S '$(or $(ARCHETIDE_ROOT),.)' -B '$(BUILD)' $$new -DARCHETIDE_WERROR=$(WERROR) >'$(BUILD)/configure.log' 2>&1 \
  || { cat '$(BUILD)/configure.log' >&2; exit 1; }
cmake --build '$(BUILD)' --parallel $(JOBS) $(if $(1),--target $(1))
endef

build: deps
	$(call archetide_compile,archetide-precompute archetide-sim)

# Tests run side by side, each on two threads: those that wait must not spin.
ARCHETIDE_TEST_THREADS = OMP_NUM_THREADS=$${OMP_NUM_THREADS:-2} OMP_WAIT_POLICY=passive
check: deps
	$(call archetide_compile)
	$(ARCHETIDE_TEST_THREADS) ctest --test-dir '$(BUILD)' -L fast --output-on-failure -j$(JOBS)

# Every slow test (random scenes, validation), hours. NOT='^SlowDam': but these.
slow: deps
	$(call archetide_compile)
	$(ARCHETIDE_TEST_THREADS) ctest --test-dir '$(BUILD)' -L slow $(if $(NOT),-E '$(NOT)') --output-on-failure -j$(JOBS)

# All that CI leaves out, hours: slow tests, hard cases, every row of the scorecard, the scenes of the paper coarsely, and the
# attacks. OUT/nightly/index.html says how each went, now and before. Goes on where it was stopped, and behind a part that
# fails. PARTS='slow fuzz': only these. Without "+", with which make -n would write results.
nightly: deps
	PARTS='$(PARTS)' sh '$(ARCHETIDE_ROOT)tests/nightly/run_nightly.sh' '$(OUT)' \
	  "$$(git -C '$(or $(ARCHETIDE_ROOT),.)' describe --always --dirty 2>/dev/null || echo unknown-dirty)" \
	  $(ARCHETIDE_MAKE) OUT='$(OUT)'

# ---- Attacks --------------------------------------------------------------------------------------------------------

# Seconds of each fuzzer, and of mutate; SEED: of mutate and faults.
FUZZ_SECONDS ?= 60
SEED ?= 1
# All of ours but precompute's meshers, compiled by clang so that it checks itself as it runs: memory and undefined behaviour
# (address), or races (thread). $(1): which; $(2): targets.
define archetide_compile_checked
$(call archetide_new_folder,$(BUILD)-$(1),$(1)); \
cmake -S '$(or $(ARCHETIDE_ROOT),.)' -B '$(BUILD)-$(1)' $$new
cmake --build '$(BUILD)-$(1)' --parallel $(JOBS) $(if $(2),--target $(2))
endef

# Not in archetide_compile_checked: with a "+" in it make -n would run all of its lines.
fuzz sanitize-address sanitize-thread: archetide-clang
archetide-clang:
	+$(ARCHETIDE_MAKE) deps ALSO='$(ARCHETIDE_CLANG_PACKAGES)'

# Random inputs for every reader, guided by what they reach: OUT/fuzz; TARGETS='ply scene': only these.
fuzz:
	$(call archetide_compile_checked,address,fuzzers)
	FUZZ_SECONDS='$(FUZZ_SECONDS)' sh '$(ARCHETIDE_ROOT)tests/fuzz/run_fuzzers.sh' '$(BUILD)-address/bin' \
	  '$(ARCHETIDE_ROOT)tests/fuzz/corpus' '$(OUT)/fuzz' $(TARGETS)

# The fast tests and three scenes on two threads, checked while they run. CHECK=address, thread: only that one.
# Address: without the tests of ARCHETIDE_LONG_CHECKED, which would take hours. Leaks are not looked for: libraries keep
# memory to the end. Races are looked for in the tests of what runs on several threads (but for test_unit_coupling, whose
# own operator new clashes with the checker's); without its tool archer the checker does not know of the barriers of OpenMP.
CHECK ?= address thread
ARCHETIDE_LONG_CHECKED = Scorecard\.QuickRows|FullBodySteps\.
ARCHETIDE_THREADED_TESTS := $(addprefix test_unit_,grid numerics fluid cut_cells pressure)
ARCHETIDE_CHECK_SCENES = sh '$(ARCHETIDE_ROOT)tests/sanitize/run_scenes.sh' '$(BUILD)-$(1)/bin/archetide-sim' '$(ASSETS)' \
  '$(ARCHETYPES)' '$(OUT)/sanitize/$(1)'
sanitize: $(CHECK:%=sanitize-%)
sanitize-address:
	$(call archetide_compile_checked,address,)
	+$(ARCHETIDE_MAKE) OUT='$(OUT)' bodies
	@export ASAN_OPTIONS=detect_leaks=0; failed=0; \
	OMP_NUM_THREADS=1 ctest --test-dir '$(BUILD)-address' -L fast -E '$(ARCHETIDE_LONG_CHECKED)' \
	  --output-on-failure -j$(JOBS) || failed=3; \
	$(call ARCHETIDE_CHECK_SCENES,address) || failed=3; \
	sh '$(ARCHETIDE_ROOT)tests/sanitize/instruction_sets.sh' '$(ARCHETIDE_SIM)' \
	  '$(BUILD)-address/bin/archetide-sim' '$(ASSETS)' '$(ARCHETYPES)' '$(OUT)/sanitize/instruction_sets' || failed=3; \
	exit $$failed
sanitize-thread:
	$(call archetide_compile_checked,thread,archetide-sim $(ARCHETIDE_THREADED_TESTS))
	+$(ARCHETIDE_MAKE) OUT='$(OUT)' bodies
	@export TSAN_OPTIONS=halt_on_error=1:ignore_noninstrumented_modules=1 OMP_NUM_THREADS=2 OMP_WAIT_POLICY=passive \
	  OMP_TOOL_LIBRARIES="$$(clang++ -print-file-name=libarcher.so)"; \
	for t in $(ARCHETIDE_THREADED_TESTS); do '$(BUILD)-thread/bin/'$$t --gtest_brief=1 --gtest_filter=-Slow* || exit 3; done; \
	$(call ARCHETIDE_CHECK_SCENES,thread)

# Ten minutes and one of scene time, coarsely, in which nothing may grow: OUT/long/long.md, an hour; QUICK=1: a tenth of the
# time. SCENES='tub': only these.
long:
	+$(ARCHETIDE_MAKE) OUT='$(OUT)' bodies
	QUICK='$(QUICK)' SCENES='$(SCENES)' THREADS='$(archetide_threads)' OMP_WAIT_POLICY=passive \
	  sh '$(ARCHETIDE_ROOT)tests/long/run_long.sh' '$(ARCHETIDE_SIM)' '$(ASSETS)' '$(ARCHETYPES)' '$(OUT)/long'

# Command lines and files with random mistakes in them: exit codes, messages, time and memory.
mutate: deps
	$(call archetide_compile,mutate archetide-precompute archetide-sim)
	'$(BUILD)/bin/mutate' '$(BUILD)/bin' '$(ARCHETIDE_ROOT)assets' '$(OUT)/mutate' --seed '$(SEED)' --seconds '$(FUZZ_SECONDS)'

# Whether the fast tests notice a line that was changed: COUNT lines, hours.
mutations: deps
	JOBS='$(JOBS)' sh '$(ARCHETIDE_ROOT)tests/mutation/run_mutations.sh' '$(or $(ARCHETIDE_ROOT),.)' '$(OUT)/mutations' \
	  '$(or $(COUNT),200)' '$(SEED)'

# Kills, signals, full disks, little memory, strange clocks, names and languages: a table. QUICK=1: a tenth of the trials.
faults: deps
	$(call archetide_compile,faults archetide-precompute archetide-sim)
	'$(BUILD)/bin/faults' '$(BUILD)/bin' '$(OUT)/faults' $(if $(QUICK),--quick) --seed '$(SEED)' $(ROWS)

# Archetypes and runs need the programs to exist; they do not grow stale because a program is newer.
$(ARCHETIDE_PRECOMPUTE) $(ARCHETIDE_SIM) &:
	+$(ARCHETIDE_MAKE) build

# The hard cases of stability, the slow ones too (QUICK=1: without them), and a table of what was measured: OUT/hard/hard.txt.
# Cases that passed with these programs are not run again. CASES='H07 H12': only these.
hard: deps
	$(call archetide_compile)
	QUICK='$(QUICK)' JOBS='$(JOBS)' OMP_WAIT_POLICY=passive sh '$(ARCHETIDE_ROOT)tests/hard/run_cases.sh' \
	  '$(ARCHETIDE_ROOT)tests/hard/cases.txt' '$(BUILD)/bin' '$(OUT)/hard' $(CASES)

# ---- Archetypes -----------------------------------------------------------------------------------------------------

bodies: $(ARCHETIDE_BODIES:%=$(ARCHETYPES)/%.h5)

# Written aside and renamed by the program: a body that fails keeps its old archetype.
$(ARCHETYPES)/%.h5: $(ASSETS)/bodies/%.body.toml | $(ARCHETIDE_PRECOMPUTE)
	@mkdir -p '$(@D)'
	$(LAUNCH) '$(ARCHETIDE_PRECOMPUTE)' build '$<' -o '$@' --depfile '$@.d' -t 1

-include $(wildcard $(ARCHETYPES)/*.h5.d)

# ---- Runs -----------------------------------------------------------------------------------------------------------

ARCHETIDE_DONE := $(ARCHETIDE_SCENES:%=$(OUT)/runs/%/done.stamp)
runs: $(ARCHETIDE_DONE)

.PHONY: $(ARCHETIDE_SCENES:%=run/%) $(ARCHETIDE_SCENES:%=film/%)
$(ARCHETIDE_SCENES:%=run/%): run/%: $(OUT)/runs/%/done.stamp

archetide_words = $(SETS) $(SETS_$(1))
archetide_set = $(foreach word,$(call archetide_words,$(1)), --set '$(word)')
# Threads of one run: all cores, divided by the jobs of `make -jN`.
archetide_threads = $(or $(THREADS),$(shell n=$(or $(patsubst -j%,%,$(filter -j%,$(MAKEFLAGS))),1); \
  c=$$(nproc); echo $$(( n < c ? c / n : 1 ))))

# Asks for large pages where the system gives them on request: fields are read along three axes. No result changes.
ARCHETIDE_LARGE_PAGES = GLIBC_TUNABLES=$${GLIBC_TUNABLES:-glibc.malloc.hugetlb=1}

$(ARCHETIDE_DONE): $(OUT)/runs/%/done.stamp: $(ASSETS)/scenes/%.scene.toml | $(ARCHETIDE_SIM)
	@mkdir -p '$(@D)' '$(ARCHETIDE_STATE)'
	$(ARCHETIDE_LARGE_PAGES) $(LAUNCH) '$(ARCHETIDE_SIM)' run '$<' -o '$(@D)' --resume auto --replace --archetypes '$(ARCHETYPES)' -t $(archetide_threads)$(call archetide_set,$*)
	@echo '$(strip $(call archetide_words,$*))' >'$(ARCHETIDE_STATE)/$*.sets'

# A run that was made with other key=value words than those given now is stale (none given: any will do).
archetide_other_words = $(if $(strip $(call archetide_words,$(1))),$(shell \
  [ "$$(cat '$(ARCHETIDE_STATE)/$(1).sets' 2>/dev/null)" = '$(strip $(call archetide_words,$(1)))' ] || echo '$(1)'))
ARCHETIDE_STALE := $(foreach scene,$(ARCHETIDE_SCENES),$(call archetide_other_words,$(scene)))
$(ARCHETIDE_STALE:%=$(OUT)/runs/%/done.stamp): FORCE

# What each scene reads (archetypes, obstacles), as the simulator lists it when a run is wanted (not by make -n).
ARCHETIDE_GOALS := $(filter-out deps build check slow nightly hard fuzz mutate mutations faults sanitize% long demo bodies scorecard figure11 paper measurements docs deb list new-body clean help,$(or $(MAKECMDGOALS),pipeline))
ifneq ($(if $(findstring n,$(firstword -$(MAKEFLAGS))),,$(ARCHETIDE_GOALS)),)
$(ARCHETIDE_STATE)/%.d: $(ASSETS)/scenes/%.scene.toml | $(ARCHETIDE_SIM)
	@mkdir -p '$(@D)'
	@'$(ARCHETIDE_SIM)' deps '$<' -o '$@' --archetypes '$(ARCHETYPES)' '$(OUT)/runs/$*/done.stamp'
-include $(ARCHETIDE_SCENES:%=$(ARCHETIDE_STATE)/%.d)
else
-include $(wildcard $(ARCHETIDE_SCENES:%=$(ARCHETIDE_STATE)/%.d))
endif

# A file that a fragment names and that is gone is the program's to complain about, not make's.
$(ASSETS)/%: ;
.PRECIOUS: $(ASSETS)/%

# ---- Pictures and report --------------------------------------------------------------------------------------------

$(ARCHETIDE_SCENES:%=film/%): film/%: $(ARCHETIDE_STATE)/%.film

$(ARCHETIDE_STATE)/%.film: $(OUT)/runs/%/done.stamp | $(ARCHETIDE_SIM)
	@mkdir -p '$(@D)'
	$(LAUNCH) '$(ARCHETIDE_SIM)' render '$(OUT)/runs/$*' $(RENDER)
	@touch '$@'

# A run as a Blender file: bodies and obstacles, with the water of each frame.
.PHONY: $(ARCHETIDE_SCENES:%=blender/%)
$(ARCHETIDE_SCENES:%=blender/%): blender/%: $(OUT)/runs/%/done.stamp | $(ARCHETIDE_SIM)
	@command -v blender >/dev/null || { echo 'blender: not found; apt-get install blender python3-numpy' >&2; exit 5; }
	$(LAUNCH) '$(ARCHETIDE_SIM)' export '$(OUT)/runs/$*' -o '$(OUT)/runs/$*/film.glb' --archetypes '$(ARCHETYPES)'
	$(LAUNCH) blender -b --python-exit-code 5 --python '$(ARCHETIDE_ROOT)tools/blender/open_run.py' \
	  -- '$(OUT)/runs/$*' '$(OUT)/runs/$*/film.glb' '$(OUT)/runs/$*/$*.blend' >'$(OUT)/runs/$*/blender.log' \
	  || { cat '$(OUT)/runs/$*/blender.log' >&2; exit 5; }
	@echo 'blender: open $(OUT)/runs/$*/$*.blend and let its script run'

# Of every run that is there; runs nothing.
report: | $(ARCHETIDE_SIM)
	@set -- '$(OUT)'/runs/*/done.stamp; \
	[ -e "$$1" ] || { echo "report: no finished run in $(OUT)/runs" >&2; exit 2; }; \
	for stamp; do shift; set -- "$$@" "$${stamp%/done.stamp}"; done; \
	$(LAUNCH) '$(ARCHETIDE_SIM)' report "$$@" -o '$(OUT)/report.html'

# Every figure with a known answer, and what some choices of method cost and give: OUT/scorecard.csv, OUT/bench/ and
# OUT/scorecard.html. Rows and points that are there, of the same program, are kept. Fails, with the page written, when
# a row misses its target that is not known to.
ARCHETIDE_BENCH = '$(ARCHETIDE_SIM)' bench '$(ASSETS)/scenes/tub.scene.toml' --archetypes '$(ARCHETYPES)' -t 1
ARCHETIDE_BENCH_COARSE = $(ARCHETIDE_BENCH) --until 0.5 --set 'fluid.grid=[24,24,24]' --set fluid.cell=1/24
ARCHETIDE_HINGE = {bodies=["$(1)","$(2)"],points=[[0.27,0.03,0],[0.27,-0.03,0]]}
ARCHETIDE_BENCH_CHAIN = '$(ARCHETIDE_SIM)' bench '$(ASSETS)/scenes/chain.scene.toml' --archetypes '$(ARCHETYPES)' -t 1 \
  --until 0.5 --set 'fluid.grid=[48,24,24]' --set fluid.cell=1/24
scorecard: deps
	$(call archetide_compile,scorecard archetide-precompute archetide-sim)
	+$(ARCHETIDE_MAKE) '$(ARCHETYPES)/torus.h5'
	@mkdir -p '$(OUT)/bench'
	@'$(BUILD)/bin/scorecard' -o '$(OUT)/scorecard.csv'; status=$$?; [ $$status = 0 ] || [ $$status = 3 ] || exit $$status; \
	$(ARCHETIDE_BENCH) --until 0.5 -o '$(OUT)'/bench/geometry \
	  --sweep fluid.cell=1/16,1/24,1/32,1/48 --sweep coupling.geometry=cut-cell,voxel \
	  --reference fluid.cell=1/64 --reference coupling.geometry=cut-cell || exit $$?; \
	$(ARCHETIDE_BENCH_COARSE) -o '$(OUT)'/bench/scheme --set step.cfl=4 \
	  --sweep step.max=0.0416,0.02,0.01,0.005 --sweep step.scheme=newmark,single \
	  --reference step.max=0.0025 --reference step.scheme=newmark || exit $$?; \
	$(ARCHETIDE_BENCH) --until 0.5 --set 'fluid.grid=[48,48,48]' --set fluid.cell=1/48 \
	  -o '$(OUT)'/bench/cfl --sweep step.cfl=0.5,1,2,3,4 --reference 0.25 || exit $$?; \
	$(ARCHETIDE_BENCH_COARSE) -o '$(OUT)'/bench/modes --sweep body.modes=0,1,2,3,5,8 --reference 11 || exit $$?; \
	$(ARCHETIDE_BENCH_COARSE) -o '$(OUT)'/bench/tolerance \
	  --sweep coupling.tolerance=1e-2,1e-3,1e-4,1e-6,1e-8 --reference 1e-12 || exit $$?; \
	$(ARCHETIDE_BENCH_COARSE) --set fluid.particles.per_cell=4 -o '$(OUT)'/bench/particles \
	  --sweep 'fluid.particles=absent,{per_cell=4},{per_cell=16},{per_cell=64}' || exit $$?; \
	$(ARCHETIDE_BENCH_COARSE) -o '$(OUT)'/bench/contact \
	  --sweep 'contact=absent,{restitution=0.1,friction=0.4}' || exit $$?; \
	$(ARCHETIDE_BENCH) --until 2 --set fluid.particles.per_cell=4 -o '$(OUT)'/bench/paper \
	  --sweep fluid.cell=1/64 --sweep coupling.geometry=cut-cell,voxel \
	  --sweep coupling.modal_step=trapezoid,backward-euler --sweep coupling.modal_mass=exact,paper \
	  --sweep 'fluid.particles=absent,{per_cell=64}' --reference fluid.cell=1/128 --reference coupling.geometry=cut-cell \
	  --reference coupling.modal_step=trapezoid --reference coupling.modal_mass=exact --reference fluid.particles=absent \
	  || exit $$?; \
	$(ARCHETIDE_BENCH_CHAIN) -o '$(OUT)'/bench/joints --sweep 'joint=absent,[$(call \
	  ARCHETIDE_HINGE,left,middle)],[$(call ARCHETIDE_HINGE,left,middle),$(call ARCHETIDE_HINGE,middle,right)]' \
	  || exit $$?; \
	'$(ARCHETIDE_SIM)' report '$(OUT)/scorecard.csv' \
	  $(patsubst %,'$(OUT)/bench/%',geometry scheme cfl modes tolerance particles contact paper joints) \
	  -o '$(OUT)/scorecard.html' || exit $$?; \
	echo "scorecard: open $(OUT)/scorecard.html"; exit $$status

# Fig. 11 of the paper: 50 rings with 10 modes and with every node, 5k and 60k tets, in four curves: OUT/figure11. Hours;
# QUICK=1: 4 rings on a coarse grid, minutes.
figure11: deps
	$(call archetide_compile,archetide-precompute archetide-sim bench_figure11)
	QUICK='$(QUICK)' OMP_WAIT_POLICY=passive sh '$(ARCHETIDE_ROOT)tests/bench/figure11/run_figure11.sh' \
	  '$(ARCHETIDE_ROOT)tests/bench/figure11' '$(BUILD)/bin' '$(OUT)/figure11$(if $(QUICK),_quick)'

# Every scene of the paper at its own grid, one after another, with films: OUT/paper/index.html and paper.md. Runs that have
# ended are not run again, an interrupted one goes on. Hours; QUICK=1: coarse and short, minutes, in OUT/paper_quick.
# SCENES='tub tori50': only these. BODIES=paper: bodies of as many linear tets as the paper's, in OUT/paper_tets.
ARCHETIDE_PAPER = $(OUT)/paper$(if $(BODIES),_tets)$(if $(QUICK),_quick)
ARCHETIDE_PAPER_TETS = $(OUT)/paper_bodies
paper: deps
	@case '$(BODIES)' in ''|paper) ;; *) echo 'paper: BODIES can only be "paper", or left out' >&2; exit 2;; esac
	$(call archetide_compile,archetide-precompute archetide-sim bench_paper)
ifeq ($(BODIES),paper)
	sh '$(ARCHETIDE_ROOT)tests/bench/paper/write_bodies.sh' '$(ASSETS)/bodies' '$(ARCHETIDE_PAPER_TETS)/bodies'
	+$(ARCHETIDE_MAKE) OUT='$(OUT)' ASSETS='$(ARCHETIDE_PAPER_TETS)' ARCHETYPES='$(ARCHETIDE_PAPER_TETS)' bodies
else
	+$(ARCHETIDE_MAKE) OUT='$(OUT)' bodies
endif
	QUICK='$(QUICK)' SCENES='$(SCENES)' RENDER='$(RENDER)' THREADS='$(archetide_threads)' OMP_WAIT_POLICY=passive \
	  sh '$(ARCHETIDE_ROOT)tests/bench/paper/run_paper.sh' '$(ARCHETIDE_ROOT)tests/bench/paper/scenes.txt' '$(BUILD)/bin' \
	  '$(ASSETS)' '$(if $(BODIES),$(ARCHETIDE_PAPER_TETS),$(ARCHETYPES))' '$(ARCHETIDE_PAPER)'

# Everything measured, as docs/measurements.md: the scorecard with its sweeps, the hard cases, and the programs of
# tests/bench/benches.txt. QUICK=1: what takes seconds; SLOW=1: what takes hours as well. What is there, of the same
# programs, is not run again. Fails, with the page written, when something failed or misses its target.
ARCHETIDE_TORUS60K = $(ARCHETYPES)/torus60k.h5
$(ARCHETIDE_TORUS60K): $(ASSETS)/bodies/torus.body.toml | $(ARCHETIDE_PRECOMPUTE)
	@mkdir -p '$(OUT)/measured'
	sed -e 's|^mesh = .*|mesh = "$(abspath $(ASSETS))/bodies/torus.obj"|' -e 's|^tet = .*|tet = { target = 60_000, order = 1 }|' \
	  '$<' >'$(OUT)/measured/torus60k.body.toml'
	'$(ARCHETIDE_PRECOMPUTE)' build '$(OUT)/measured/torus60k.body.toml' -o '$@' -t 1

ARCHETIDE_SWEEPS := geometry scheme cfl modes tolerance particles contact joints
measurements: deps
	$(call archetide_compile)
	+$(ARCHETIDE_MAKE) OUT='$(OUT)' bodies '$(ARCHETIDE_TORUS60K)'
	-$(if $(QUICK),'$(BUILD)/bin/scorecard' --quick -o '$(OUT)/scorecard.csv',+$(ARCHETIDE_MAKE) OUT='$(OUT)' scorecard)
	-+$(ARCHETIDE_MAKE) OUT='$(OUT)' QUICK='$(if $(SLOW),,1)' hard
	-ARCHETYPES='$(ARCHETYPES)' ASSETS='$(ASSETS)' QUICK='$(QUICK)' SLOW='$(SLOW)' \
	  sh '$(ARCHETIDE_ROOT)tests/bench/run_benches.sh' '$(ARCHETIDE_ROOT)tests/bench/benches.txt' '$(BUILD)/bin' '$(OUT)/measured'
	'$(BUILD)/bin/scorecard' $(if $(QUICK),--quick) -o '$(OUT)/scorecard.csv' --report '$(ARCHETIDE_ROOT)docs/measurements.md' \
	  --commit "$$(git -C '$(or $(ARCHETIDE_ROOT),.)' describe --always --dirty 2>/dev/null)" \
	  --hard '$(OUT)/hard/hard.csv' --benches '$(OUT)/measured/benches.csv' \
	  $(foreach s,$(ARCHETIDE_SWEEPS),--sweep '$(OUT)/bench/$(s)/bench.csv') \
	  --recorded '$(ARCHETIDE_ROOT)tests/scorecard/recorded.csv'

# Validates every scene, runs those that are stale; a run that misses its [expect] fails.
check-scenes: | $(ARCHETIDE_SIM) bodies
	@for scene in $(ARCHETIDE_SCENES); do \
	  '$(ARCHETIDE_SIM)' check '$(ASSETS)/scenes/'"$$scene.scene.toml" --archetypes '$(ARCHETYPES)' || exit $$?; done
	+$(ARCHETIDE_MAKE) OUT='$(OUT)' SETS='$(SETS)' runs

# The first thing to try: two of the paper's scenes, coarse, with films and a report, in OUT/demo.
ARCHETIDE_DEMO = $(ARCHETIDE_MAKE) OUT='$(OUT)/demo' RENDER='--size 640x360' \
  SETS_tub='fluid.grid=[48,48,48] fluid.cell=1/48' \
  SETS_buoyancy='fluid.grid=[100,20,55] fluid.cell=0.05 time.end=5'
demo: build
	+$(ARCHETIDE_DEMO) film/tub
	+$(ARCHETIDE_DEMO) film/buoyancy
	+$(ARCHETIDE_DEMO) report
	@echo "demo: open $(OUT)/demo/report.html and $(OUT)/demo/runs/tub/film.mp4"

# The tables of all keys, which end these two pages, from the programs.
archetide_keys = page='$(ARCHETIDE_ROOT)docs/$(1)'; { sed '/^| key | type |/,$$d' "$$page" && '$(2)' schema --md; } >"$$page.part" && \
  mv "$$page.part" "$$page"
docs: build
	$(call archetide_keys,scenes.md,$(ARCHETIDE_SIM))
	$(call archetide_keys,bodies.md,$(ARCHETIDE_PRECOMPUTE))

# A Debian package of the programs, for any machine of this architecture.
deb:
	+$(ARCHETIDE_MAKE) deps ALSO='dpkg-dev file'
	$(call archetide_new_folder,$(BUILD)-portable,portable); \
	cmake -S '$(or $(ARCHETIDE_ROOT),.)' -B '$(BUILD)-portable' $$new -DARCHETIDE_TESTS=OFF
	cmake --build '$(BUILD)-portable' --parallel $(JOBS)
	@mkdir -p '$(OUT)'
	cpack --config '$(BUILD)-portable/CPackConfig.cmake' -B '$(OUT)/deb'
	@echo 'deb: install it with apt-get install $(OUT)/deb/*.deb'

# ---- Housekeeping ---------------------------------------------------------------------------------------------------

# `make -q` tells stale from built.
archetide_status = if [ ! -e "$(1)" ]; then echo missing; \
  elif $(ARCHETIDE_MAKE) OUT='$(OUT)' list -q ARCHETIDE_ASK="$(1)" >/dev/null 2>&1; then echo built; else echo stale; fi
ifdef ARCHETIDE_ASK
list: $(ARCHETIDE_ASK)
else
list:
	@for n in $(ARCHETIDE_BODIES); do \
	  printf 'body   %-20s %s\n' "$$n" "$$($(call archetide_status,$(ARCHETYPES)/$$n.h5))"; done
	@for n in $(ARCHETIDE_SCENES); do \
	  printf 'scene  %-20s %s\n' "$$n" "$$($(call archetide_status,$(OUT)/runs/$$n/done.stamp))"; done
endif

# make -f pipeline.mk new-body M=path/duck.obj [NAME=duck] [SCALE=0.01] [DENSITY=500]
# The words come through the environment, so that the shell does not read them as commands. The mesh is copied when there
# is a body file for it.
new-body: export ARCHETIDE_MESH = $(M)
new-body: export ARCHETIDE_NAME = $(NAME)
new-body: export ARCHETIDE_SCALE = $(SCALE)
new-body: export ARCHETIDE_DENSITY = $(DENSITY)
new-body: | $(ARCHETIDE_PRECOMPUTE)
	@mesh=$$(basename -- "$$ARCHETIDE_MESH"); name=$${ARCHETIDE_NAME:-$${mesh%.*}}; \
	[ -n "$$ARCHETIDE_MESH" ] || { echo "new-body: say which mesh: new-body M=duck.obj" >&2; exit 2; }; \
	[ -f "$$ARCHETIDE_MESH" ] || { echo "new-body: $$ARCHETIDE_MESH: no such file" >&2; exit 2; }; \
	for word in "$$mesh" "$$name"; do $(call archetide_plain,"$$word") || { \
	  echo "new-body: $$word: make cannot handle this file name; $(ARCHETIDE_RENAME)" >&2; exit 2; }; done; \
	folder='$(ASSETS)/bodies'; recipe="$$folder/$$name.body.toml"; copy="$$folder/$$mesh"; mkdir -p "$$folder"; \
	[ ! -e "$$recipe" ] || { echo "new-body: $$recipe is there already; remove it for another proposal" >&2; exit 2; }; \
	[ ! -e "$$copy" ] || cmp -s -- "$$ARCHETIDE_MESH" "$$copy" || { echo "new-body: $$copy is another mesh" >&2; exit 2; }; \
	set -- -o "$$recipe" --mesh-name="$$mesh" $${ARCHETIDE_SCALE:+"--scale=$$ARCHETIDE_SCALE"} \
	  $${ARCHETIDE_DENSITY:+"--density=$$ARCHETIDE_DENSITY"} -t 1 -- "$$ARCHETIDE_MESH"; \
	'$(ARCHETIDE_PRECOMPUTE)' propose "$$@" || exit; \
	[ -e "$$copy" ] || cp -- "$$ARCHETIDE_MESH" "$$copy" || { rm -f -- "$$copy" "$$recipe"; exit 5; }; \
	echo "new-body: wrote $$recipe; edit it if you like, then: make -f $(ARCHETIDE_SELF) bodies"

# Programs and the demo. Archetypes and runs cost time: delete OUT by hand.
clean:
	rm -rf '$(BUILD)' '$(OUT)/demo'

help:
	@echo 'make -f $(ARCHETIDE_SELF) [-jN] [TARGET...] [ASSETS=dir] [OUT=dir] [SETS="key=value ..."] [THREADS=n] [LAUNCH="srun -n1"]'
	@echo '  (none)       all archetypes, then all runs        demo         install, build, run and film two coarse scenes'
	@echo '  bodies       all archetypes                       check        install, build, run every fast test'
	@echo '  run/NAME     one scene (and what it needs)        film/NAME    its pictures and film'
	@echo '  report       OUT/report.html of the runs there    list         bodies and scenes: built, stale or missing'
	@echo '  blender/NAME a run as a Blender file, with its water docs         the tables of all keys in docs/ from the programs'
	@echo '  deb          a Debian package of the programs, in OUT/deb'
	@echo '  figure11     Fig. 11 of the paper: rings with modes and with every node, hours; QUICK=1: minutes'
	@echo '  paper        every scene of the paper as its file stands, with films: OUT/paper/index.html, hours; QUICK=1: minutes;'
	@echo '               SCENES="tub tori50"; BODIES=paper: with as many linear tets as the paper'
	@echo '  scorecard    every figure with a known answer, error against CPU seconds: OUT/scorecard.csv, OUT/scorecard.html'
	@echo '  measurements everything measured, as docs/measurements.md; QUICK=1: what takes seconds, SLOW=1: what takes hours too'
	@echo '  new-body     M=duck.obj [SCALE=0.01] [DENSITY=1000]: looks at a mesh and writes a body file that builds'
	@echo '  check-scenes validates all scenes, runs the stale ones'
	@echo '  hard         40 hard cases, with a table           QUICK=1      of them those that take seconds'
	@echo '  slow         every slow test; takes hours'
	@echo '  nightly      check, slow, hard, the whole scorecard and the attacks below, with a page of results; takes hours;'
	@echo '               PARTS="slow fuzz"'
	@echo '  fuzz         random inputs for every reader, FUZZ_SECONDS=60 each, TARGETS="ply scene"'
	@echo '  mutate       random mistakes in command lines and files, FUZZ_SECONDS=60, SEED=1'
	@echo '  faults       kills, signals, full disks, little memory, odd names: a table; QUICK=1, ROWS="kill-run"'
	@echo '  long         minutes of scene time in which nothing may grow, an hour; QUICK=1: a tenth of it; SCENES="tub"'
	@echo '  mutations    whether the fast tests notice a changed line: COUNT=200, SEED=1; hours'
	@echo '  sanitize     fast tests and scenes with checks of memory, undefined behaviour and races (clang); CHECK=address, thread'
	@echo '  deps, build  what demo and check begin with       clean        programs and demo; keeps archetypes and runs'
