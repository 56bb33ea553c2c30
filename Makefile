# `make help` prints the lines that begin with "#:".
#: make              the programs, liblgd.a and liblgd.so, in build/
#: make demo         the same, then demo/flash.jpg to maps in build/demo/
#: make test         the same, then every test
#: make deps         installs what the build needs (Debian, Ubuntu) and Open MPI; make test does so first, make and make
#:                   demo without MPI
#: make test-blender material.glb and the add-on in Blender, with PYTHON= that has bpy; skipped without
#: make test-folders 10,000 photographs under kill -9, and the memory over 100, 1,000 and 10,000: some minutes
#: make install      into PREFIX (/usr/local), libraries into LIBDIR, below DESTDIR when given; make uninstall undoes it
#: make manuals      manual pages and completions of bash and zsh, from --help: make install brings them
#: make wheel        the Python package as build/lgd-VERSION-….whl, with the library and phone's weights in it
#: make blender      the Blender add-on as build/lgd_material-VERSION.zip, with that wheel in it
#: make deb          Debian packages into build/: lgd, liblgd0, liblgd-dev, lgd-models, python3-lgd
#: make bench        times; BENCH="conv_ infer" runs the benchmarks whose names contain these words
#: make bench-deps   PyTorch, torch.compile and OpenVINO, for the comparison in make bench
#: make stress       the numerics far from ordinary input; STRESS=shading runs one part
#: make fuzz         the readers under libFuzzer; FUZZ=torch for one of them, FUZZ_SECONDS=600 for each
#: make faults       every program with each call that can fail failing, one at a time; then with LeakSanitizer
#: make tsan         lgd-infer with many photographs, lgd-train's loader with ThreadSanitizer, in build-tsan/
#: make asan         make test with the address and undefined-behaviour sanitizers, in build-asan/
#: make clean        deletes what make has built
#: Variables: V=1 prints the commands, YES=1 installs packages without asking, -j1 is one job (default: one a CPU),
#: BUILD= another folder, CC= CXX= CFLAGS= CPPFLAGS= LDLIBS= as usual, TESTDATA= FIXTURES= data for tests.
CC ?= cc
ifeq ($(origin CC),default)
CC := gcc
endif
ifeq ($(origin CXX),default)
CXX := g++
endif
OBJCOPY ?= objcopy
STRIP ?= strip
PREFIX ?= /usr/local
LIBDIR ?= $(PREFIX)/lib
TESTDATA ?= ../shared/testdata
FIXTURES ?= ../shared/fixtures
BUILD ?= build
PYTHON ?= python3
WHEELS ?= $(BUILD)
DEBS ?= $(BUILD)
OPT ?= -O3 -g
SANITIZE ?=

VERSION := 0.2.0
# The number of the shared library's binary interface: it grows when a program that is linked with it has to be again.
SONAME := liblgd.so.0

# A line for a step; V=1 prints the commands instead.
ifeq ($(V),1)
step = @:
else
Q := @
step = @printf '  %-5s %s\n' '$(1)' '$(2)'
endif
# Below another make the jobs are its own.
ifeq (0,$(MAKELEVEL)$(filter -j% --jobserver%,$(MAKEFLAGS)))
MAKEFLAGS += -j$(shell nproc 2>/dev/null || echo 2)
endif
# Several goals would begin makes at once that write the same files: they are made one after the other. The makes below
# compile in parallel as ever.
ifeq (0,$(MAKELEVEL))
ONE_BY_ONE := $(and $(word 2,$(MAKECMDGOALS)),$(filter-out programs library $(BUILD)/%,$(MAKECMDGOALS)))
endif
ifneq (,$(ONE_BY_ONE))
.NOTPARALLEL:
endif

# What the programs read and write themselves, and what only the shared object needs that reads all other image formats.
PKG := OpenEXR libpng libjpeg zlib libisal lcms2
PKG_IMAGE := OpenImageIO
# Optional: the tags of a printed sheet (data/rectify/tags.c).
PKG_TAGS := apriltag
# Training in several processes (train/mpi/mpi.h): a shared object for each MPI library that is installed, none without.
PKG_openmpi := ompi-c
PKG_mpich := mpich
WARN := -Wall -Wextra -Wshadow
CPPFLAGS_ALL = -I. -I$(BUILD)/gen -D_GNU_SOURCE -DLGD_VERSION='"$(VERSION)"' $(CPPFLAGS)
CFLAGS_ALL = -std=c11 $(OPT) $(WARN) -Wmissing-prototypes -fno-math-errno -fno-trapping-math \
  -ffp-contract=off -fPIC -fvisibility=hidden $(SANITIZE) $(CFLAGS)
CXXFLAGS_ALL = -std=c++17 $(OPT) $(WARN) -fPIC $(SANITIZE) $(CXXFLAGS)
# Looked up only when something is compiled or linked with them, so that `make deps` and `make help` work without.
PKG_CFLAGS = $(shell pkg-config --cflags $(PKG))
# OpenEXR's C core alone: the rest of it is C++.
PKG_LIBS = $(filter-out -lOpenEXR-% -lOpenEXRUtil% -lIex% -lIlmThread% -lImath% -lOpenEXR -lIex -lImath -lIlmThread,\
  $(shell pkg-config --libs $(PKG)))
HAVE_TAGS = $(shell pkg-config --exists $(PKG_TAGS) 2>/dev/null && echo yes)
TAGS_LIBS = $(if $(HAVE_TAGS),$(shell pkg-config --libs $(PKG_TAGS)))
LDLIBS_ALL = $(TAGS_LIBS) $(LIB_LIBS)
# What liblgd needs: it knows no sheets, so no tags.
LIB_LIBS = $(PKG_LIBS) -lpthread -ldl -lm $(SANITIZE) $(LDLIBS)

MACHINE := $(shell $(CC) -dumpmachine)
ifneq (,$(filter x86_64%,$(MACHINE)))
ISAS := base avx2 avx512 avx512bf16 amx
else
ISAS := base
endif
# Intel's Skylake family does not keep decoded a jump that touches a 32-byte boundary (erratum SKX102): inner loops lose
# 6% where one falls so.
ifneq (,$(filter x86_64%,$(MACHINE)))
WHOLE_JUMPS := $(shell for f in -mbranches-within-32B-boundaries -Wa,-mbranches-within-32B-boundaries; do \
  echo 'int x;' | $(CC) $$f -xc -c -o /dev/null - 2>/dev/null && { echo $$f; break; }; done)
endif
ISA_FLAGS_base :=
ISA_FLAGS_avx2 := -mavx2 -mfma -mbmi2
ISA_FLAGS_avx512 := -mavx512f -mavx512bw -mavx512dq -mavx512vl -mavx2 -mfma -mbmi2 -mprefer-vector-width=512
ISA_FLAGS_avx512bf16 := $(ISA_FLAGS_avx512) -mavx512bf16
ISA_FLAGS_amx := $(ISA_FLAGS_avx512bf16) -mamx-tile -mamx-bf16

# Those whose main.c stands in cli/, and all.
CLI := infer data convert capture
PROGRAMS := train eval $(CLI)
ROOMS := tensor tensor/conv autograd render nn nn/weights data data/image data/materials data/rectify train train/mpi \
  infer eval eval/methods eval/metrics cli cli/capture cli/data cli/infer
LIB_C := $(filter-out %main.c train/mpi/mpi.c,$(wildcard $(ROOMS:%=%/*.c)))
KERNELS := $(wildcard tensor/kernels/*.c render/kernels/*.c)
OPS := $(sort $(wildcard autograd/op_*.c render/op_*.c))
PAGES := $(sort $(wildcard infer/page/*.* eval/page/*.*))
OBJ := $(BUILD)/obj
LIB_OBJ := $(LIB_C:%.c=$(OBJ)/%.o) $(OBJ)/gen/op_list.o $(OBJ)/gen/pages.o \
  $(foreach isa,$(ISAS),$(KERNELS:%.c=$(OBJ)/%.$(isa).o))
# Everything but the programs' main functions: what the programs are linked with.
INTERNAL := $(OBJ)/internal.a
LIB := $(BUILD)/liblgd.a
SHARED := $(BUILD)/liblgd.so.$(VERSION)
IMAGE_LIB := $(BUILD)/lib/lgd/liblgd_image.so
MPIS := $(foreach m,openmpi mpich,$(shell pkg-config --exists $(PKG_$(m)) 2>/dev/null && echo $(m)))
MPI_LIBS = $(MPIS:%=$(BUILD)/lib/lgd/liblgd_%.so)
# Of the library that a rule's stem names.
MPI_CFLAGS = $(patsubst -I%,-isystem %,$(shell pkg-config --cflags-only-I $(PKG_$*)))
MPI_LINKS = $(MPIS:%=$(BUILD)/mpi/link_%.so)
BIN := $(PROGRAMS:%=$(BUILD)/bin/lgd-%)
STRESS_C := $(filter-out %main.c,$(wildcard tests/stress/*.c))
FUZZ_C := $(filter-out %main.c,$(wildcard tests/fuzz/*.c))
FAULTS := $(BUILD)/bin/lgd-faults $(BUILD)/lib/lgd-faults.so
TEST_C := $(wildcard tests/*.c) \
  $(filter-out tests/stress/%.c tests/fuzz/%.c tests/faults/%.c,$(wildcard tests/*/*.c)) $(STRESS_C) $(FUZZ_C)
BENCH_C := $(wildcard bench/*.c)
TEST_BIN := $(BUILD)/bin/lgd-test
BENCH_BIN := $(BUILD)/bin/lgd-bench
STRESS_BIN := $(BUILD)/bin/lgd-stress
# tests/stress/training.c stands between the trainer and its data, tests/tensor/test_team.c between a team and its
# workers.
WRAP := -Wl,--wrap=io_loader_next -Wl,--wrap=tr_photographs

all: needs
	@$(MAKE) --no-print-directory programs
	@echo "The programs are in $(BUILD)/bin: $(BUILD)/bin/lgd-infer PHOTO.jpg -o DIR"

ifneq (,$(ONE_BY_ONE))
programs library:
	@$(MAKE) --no-print-directory $@
else
programs: $(BIN) library $(MPI_LIBS) $(MPI_LINKS)
	@:

library: $(LIB) $(SHARED) $(IMAGE_LIB)
endif

help:
	@sed -n 's/^#: //p' Makefile

$(BUILD)/bin/lgd-%: $(OBJ)/%/main.o $(INTERNAL)
	$(call step,LD,$@)
	@mkdir -p $(@D)
	$(Q)$(CC) -o $@ $< $(INTERNAL) $(LDLIBS_ALL)

$(CLI:%=$(BUILD)/bin/lgd-%): $(BUILD)/bin/lgd-%: $(OBJ)/cli/%/main.o $(INTERNAL)
	$(call step,LD,$@)
	@mkdir -p $(@D)
	$(Q)$(CC) -o $@ $< $(INTERNAL) $(LDLIBS_ALL)

$(TEST_BIN): WRAP += -Wl,--wrap=pthread_create
$(TEST_BIN): $(TEST_C:%.c=$(OBJ)/%.o) $(INTERNAL) | $(IMAGE_LIB)
	$(call step,LD,$@)
	@mkdir -p $(@D)
	$(Q)$(CC) -o $@ $(filter %.o %.a,$^) $(WRAP) $(LDLIBS_ALL)

# Without the sanitizers: it calls what they replace.
$(BUILD)/bin/lgd-faults: tests/faults/main.c $(BUILD)/gen/flags
	$(call step,LD,$@)
	@mkdir -p $(@D)
	$(Q)$(CC) $(CPPFLAGS_ALL) -std=c11 -O1 -g $(WARN) -o $@ $<

$(BUILD)/lib/lgd-faults.so: tests/faults/shim.c tests/faults/calls.h $(BUILD)/gen/flags
	$(call step,LD,$@)
	@mkdir -p $(@D)
	$(Q)$(CC) $(CPPFLAGS_ALL) -std=c11 -O1 -g $(WARN) -fPIC -shared -o $@ $< -ldl -lpthread

$(STRESS_BIN): $(OBJ)/tests/stress/main.o $(STRESS_C:%.c=$(OBJ)/%.o) $(INTERNAL)
	$(call step,LD,$@)
	@mkdir -p $(@D)
	$(Q)$(CC) -o $@ $(filter %.o %.a,$^) $(WRAP) $(LDLIBS_ALL)

$(BENCH_BIN): $(BENCH_C:%.c=$(OBJ)/%.o) $(INTERNAL)
	$(call step,LD,$@)
	@mkdir -p $(@D)
	$(Q)$(CC) -o $@ $(filter %.o %.a,$^) $(LDLIBS_ALL)

$(INTERNAL): $(LIB_OBJ)
	$(call step,AR,$@)
	@rm -f $@
	$(Q)$(AR) rcs $@ $(LIB_OBJ)

# The library: infer/api_model.o, infer/api_files.o and what they use, in one object whose only global symbols are those
# that lgd.h marks LGD_API.
$(OBJ)/liblgd.o: $(INTERNAL)
	$(call step,LD,$@)
	$(Q)$(CC) -r -nostdlib -o $@ $(OBJ)/infer/api_model.o $(OBJ)/infer/api_files.o $(INTERNAL)
	$(Q)$(OBJCOPY) --localize-hidden $@

$(LIB): $(OBJ)/liblgd.o
	$(call step,AR,$@)
	@rm -f $@
	$(Q)$(AR) rcs $@ $<

$(SHARED): $(OBJ)/liblgd.o
	$(call step,LD,$@)
	$(Q)$(CC) -shared -Wl,-soname,$(SONAME) -Wl,--no-undefined -Wl,-z,nodelete -o $@ $< $(LIB_LIBS)
	@ln -sf $(@F) $(BUILD)/$(SONAME) && ln -sf $(SONAME) $(BUILD)/liblgd.so

# OpenImageIO, behind the table in data/image/oiio.h. Loaded when an image needs it, never linked.
$(IMAGE_LIB): $(OBJ)/data/image/oiio.o $(OBJ)/tensor/status.o
	$(call step,LD,$@)
	@mkdir -p $(@D)
	$(Q)$(CXX) -shared -Wl,-Bsymbolic -o $@ $^ $(shell pkg-config --libs $(PKG_IMAGE)) $(SANITIZE) $(LDLIBS)

# MPI, behind the table in train/mpi/mpi.h. Loaded when mpirun has started the program, never linked.
$(MPI_LIBS): $(BUILD)/lib/lgd/liblgd_%.so: $(OBJ)/train/mpi/mpi.%.o $(OBJ)/train/mpi/rounded.o \
  $(OBJ)/train/mpi/parts.o $(OBJ)/train/mpi/place.o $(OBJ)/tensor/status.o
	$(call step,LD,$@)
	@mkdir -p $(@D)
	$(Q)$(CC) -shared -Wl,-Bsymbolic-functions -o $@ $^ $(shell pkg-config --libs $(PKG_$*)) $(SANITIZE) $(LDLIBS)

$(MPIS:%=$(OBJ)/train/mpi/mpi.%.o): $(OBJ)/train/mpi/mpi.%.o: train/mpi/mpi.c $(BUILD)/gen/flags
	$(call step,CC,$< [$*])
	@mkdir -p $(@D)
	$(Q)$(CC) $(CPPFLAGS_ALL) $(MPI_CFLAGS) $(CFLAGS_ALL) -MMD -MP -c -o $@ $<

# A slow network for tests and the bench (bench/mpi/link.c).
$(MPI_LINKS): $(BUILD)/mpi/link_%.so: bench/mpi/link.c $(BUILD)/gen/flags
	$(call step,LD,$@)
	@mkdir -p $(@D)
	$(Q)$(CC) -shared -fPIC -std=c11 -D_GNU_SOURCE -O2 $(WARN) $(MPI_CFLAGS) -o $@ $< \
	  $(shell pkg-config --libs $(PKG_$*)) -lm

# Every object is rebuilt when the flags change, and data/folders.o when PREFIX does, tags.o when its library comes or
# goes; what is made of many files, when one of them comes or goes.
# Products and sums of kernels are fused, but for what must be the same bytes on every machine.
CONTRACT ?= fast
CONTRACT_noise := off
FLAGS_NOW := $(CC) $(CXX) $(WHOLE_JUMPS) $(CFLAGS_ALL) $(CXXFLAGS_ALL) $(CPPFLAGS) $(LDLIBS) $(VERSION) \
  $(CONTRACT) $(CONTRACT_noise) $(foreach isa,$(ISAS),$(ISA_FLAGS_$(isa)))
changed = $(shell mkdir -p $(BUILD)/gen; echo '$(2)' | cmp -s - $(BUILD)/gen/$(1) || echo '$(2)' > $(BUILD)/gen/$(1))
$(call changed,flags,$(FLAGS_NOW))
$(call changed,sources,$(LIB_C) $(KERNELS) $(OPS) $(PAGES))
$(call changed,tests,$(TEST_C) $(BENCH_C))
$(TEST_BIN) $(BENCH_BIN) $(STRESS_BIN): $(BUILD)/gen/tests
$(INTERNAL) $(addprefix $(BUILD)/gen/,ops.h op_list.c pages.h pages.c): $(BUILD)/gen/sources
$(call changed,prefix,$(PREFIX) $(LIBDIR))
$(OBJ)/data/folders.o: $(BUILD)/gen/prefix
$(call changed,tags,$(HAVE_TAGS))
$(OBJ)/data/rectify/tags.o: $(BUILD)/gen/tags
$(OBJ)/data/rectify/tags.o: CPPFLAGS_ALL += $(if $(HAVE_TAGS),-DLGD_APRILTAG $(shell pkg-config --cflags $(PKG_TAGS)))
$(OBJ)/data/folders.o: CPPFLAGS_ALL += -DLGD_PREFIX='"$(PREFIX)"' -DLGD_LIBDIR='"$(LIBDIR)"'

$(OBJ)/%.o: %.c $(BUILD)/gen/flags | $(BUILD)/gen/ops.h $(BUILD)/gen/pages.h
	$(call step,CC,$<)
	@mkdir -p $(@D)
	$(Q)$(CC) $(CPPFLAGS_ALL) $(if $(filter data/image/% nn/weights/%,$<),$(PKG_CFLAGS)) $(CFLAGS_ALL) -MMD -MP -c -o $@ $<

$(OBJ)/gen/%.o: $(BUILD)/gen/%.c $(BUILD)/gen/flags | $(BUILD)/gen/ops.h $(BUILD)/gen/pages.h
	$(call step,CC,$<)
	@mkdir -p $(@D)
	$(Q)$(CC) $(CPPFLAGS_ALL) $(CFLAGS_ALL) -MMD -MP -c -o $@ $<

$(OBJ)/%.o: %.cpp $(BUILD)/gen/flags
	$(call step,CXX,$<)
	@mkdir -p $(@D)
	$(Q)$(CXX) $(CPPFLAGS_ALL) $(shell pkg-config --cflags $(PKG_IMAGE)) $(CXXFLAGS_ALL) -MMD -MP -c -o $@ $<

# One kernel source, once per instruction set. Contraction to FMA is part of what a kernel is, but for those whose bytes
# must not depend on the machine.
define KERNEL_RULE
$(OBJ)/%.$(1).o: %.c $(BUILD)/gen/flags
	$$(call step,CC,$$< [$(1)])
	@mkdir -p $$(@D)
	$$(Q)$$(CC) $$(CPPFLAGS_ALL) $$(CFLAGS_ALL) $$(ISA_FLAGS_$(1)) $$(WHOLE_JUMPS) \
	  -ffp-contract=$$(or $$(CONTRACT_$$(*F)),$(CONTRACT)) -DTS_ISA_SUFFIX=$(1) -MMD -MP -c -o $$@ $$<
endef
$(foreach isa,$(ISAS),$(eval $(call KERNEL_RULE,$(isa))))

# The prototypes of all ops (the text between "#ifdef AG_API" and "#endif" in each autograd/op_*.c) and the list of
# their descriptors.
$(BUILD)/gen/ops.h: $(filter autograd/%,$(OPS)) Makefile
	@mkdir -p $(@D)
	@{ echo '/* Made by make from autograd/op_*.c. */'; echo '#ifndef AG_OPS_H'; echo '#define AG_OPS_H'; \
	  echo '#include "autograd/tape.h"'; \
	  for f in $(sort $(filter autograd/%,$(OPS))); do \
	    sed -n '/^#ifdef AG_API$$/,/^#endif$$/{/^#/d;p}' $$f; done; echo '#endif'; } > $@.new
	@cmp -s $@.new $@ && rm $@.new || mv $@.new $@
$(BUILD)/gen/op_list.c: $(OPS) Makefile
	@mkdir -p $(@D)
	@{ echo '#include "autograd/op_list.h"'; \
	  for f in $(basename $(notdir $(OPS))); do echo "extern const ag_op $$f;"; done; \
	  echo 'const ag_op *const ag_op_list[] = {'; \
	  for f in $(basename $(notdir $(OPS))); do echo "    &$$f,"; done; echo '    0};'; } > $@

# The files that web pages are made of, as strings: infer/page/view.css is page_view_css.
page_name = page_$(subst .,_,$(notdir $(1)))
$(BUILD)/gen/pages.h: $(PAGES) Makefile
	@mkdir -p $(@D)
	@{ echo '/* Made by make from infer/page/ and eval/page/. */'; \
	  $(foreach f,$(PAGES),echo 'extern const char $(call page_name,$f)[];';) } > $@.new
	@cmp -s $@.new $@ && rm $@.new || mv $@.new $@
$(BUILD)/gen/pages.c: $(PAGES) Makefile
	@mkdir -p $(@D)
	@{ echo '#include "pages.h"'; $(foreach f,$(PAGES),echo 'const char $(call page_name,$f)[] ='; \
	  od -An -v -to1 $f | sed 's/ *\([0-7][0-7][0-7]\)/\\\1/g;s/.*/"&"/'; echo ';';) } > $@

needs:
	@sh .ci/deps.sh $(PKG) $(PKG_IMAGE) $(PKG_TAGS)
# With MPI, which a build does without: it trains in one process then.
deps:
	@sh .ci/deps.sh $(PKG) $(PKG_IMAGE) $(PKG_TAGS) $(PKG_openmpi)

# help2man before the tests, of which several that run side by side need it: apt-get has one lock.
test: deps
	@[ "$$(id -u)" -ne 0 ] || sh .ci/deps.sh help2man || :
	@$(MAKE) --no-print-directory programs $(TEST_BIN) $(FAULTS) $(BENCH_BIN) $(STRESS_BIN)
	@BUILD=$(BUILD) TESTDATA=$(TESTDATA) FIXTURES=$(FIXTURES) sh tests/run.sh

bench: needs
	@$(MAKE) --no-print-directory programs $(BENCH_BIN)
	@BUILD=$(BUILD) TESTDATA=$(TESTDATA) $(BENCH_BIN) $(BENCH)

test-blender: programs
	@BUILD=$(BUILD) sh tests/blender/run.sh

# The Python package with liblgd.so and the weights in it.
wheel: library
	@mkdir -p $(WHEELS)
	@LGD_WHEEL=own LGD_BUILD=$(BUILD) STRIP=$(STRIP) $(PYTHON) python/backend.py $(WHEELS)

# The add-on for Blender 4.2 and later, with that wheel in it.
blender: wheel
	@rm -rf $(WHEELS)/blender && mkdir -p $(WHEELS)/blender/lgd_material/wheels
	@cp "$(WHEELS)/$$($(PYTHON) python/backend.py --name)" $(WHEELS)/blender/lgd_material/wheels/
	@cp python/blender/lgd_material/__init__.py LICENSE NOTICE $(WHEELS)/blender/lgd_material/
	@cd $(WHEELS)/blender/lgd_material && sed "s/@VERSION@/$(VERSION)/; s/@WHEEL@/$$(ls wheels)/; \
	  s/@PLATFORM@/$$(uname -m | sed 's,x86_64,linux-x64,; s,aarch64,linux-arm64,')/" \
	  $(CURDIR)/python/blender/lgd_material/blender_manifest.toml.in > blender_manifest.toml
	@rm -f $(WHEELS)/lgd_material-$(VERSION).zip
	@cd $(WHEELS)/blender && $(PYTHON) -m zipfile -c ../lgd_material-$(VERSION).zip lgd_material && rm -rf lgd_material
	@echo $(WHEELS)/lgd_material-$(VERSION).zip

# With the libraries of the machine that it is called on.
deb: all
	@BUILD=$(BUILD) MAKE='$(MAKE)' sh .ci/deb.sh $(VERSION) $(DEBS)

test-folders: programs
	@BUILD=$(BUILD) sh tests/kill_folder.sh
	@BUILD=$(BUILD) sh tests/folder_memory.sh

# The peers: bench/peer_torch.py
bench-deps:
	@BUILD=$(BUILD) sh .ci/bench-deps.sh

stress: $(STRESS_BIN)
	@$(STRESS_BIN) $(STRESS)

# Leaks are looked for in the same objects with LeakSanitizer: AddressSanitizer's malloc cannot be made to fail so.
faults: programs $(FAULTS)
	@BUILD=$(BUILD) sh tests/faults/run.sh $(FAULT_OPTIONS)
	@mkdir -p $(BUILD)-leaks/bin && cp -r $(BUILD)/lib $(BUILD)/bin/lgd-faults $(BUILD)-leaks && \
	  mv $(BUILD)-leaks/lgd-faults $(BUILD)-leaks/bin
	$(Q)for p in $(PROGRAMS); do main=$(OBJ)/$$p/main.o; [ -e $$main ] || main=$(OBJ)/cli/$$p/main.o; \
	  $(CC) -o $(BUILD)-leaks/bin/lgd-$$p $$main $(INTERNAL) $(LDLIBS_ALL) -fsanitize=leak || exit 1; done
	@LSAN_OPTIONS=exitcode=23:print_suppressions=0:suppressions=tests/faults/leaks.txt \
	  BUILD=$(BUILD)-leaks ONLY_ONCE=1 sh tests/faults/run.sh $(FAULT_OPTIONS)

# clang's libFuzzer with the address and undefined sanitizers, FUZZ_SECONDS for each target. The readers are compiled
# for it; what else they need comes from the library as it is. OpenImageIO's libraries take seconds to load, and its
# PNG reader leaks a name where libpng jumps out of it.
# New inputs go to $(BUILD)/fuzz/NAME, one that breaks something to $(BUILD)/fuzz/NAME.crash-….
FUZZ ?= safetensors torch photo image config folder
FUZZ_SECONDS ?= 600
FUZZ_CC ?= clang
FUZZED := $(addprefix nn/weights/,file.c tensor_convert.c json.c safetensors_read.c zip.c pickle.c torch_objects.c \
    torch_read.c) \
  $(addprefix data/image/,png_file.c png_read.c jpeg_read.c header.c exif.c colour.c image.c \
    image_read.c image_library.c) \
  $(addprefix data/,capture.c capture_ini.c ini.c file.c name.c map_folder.c map_names.c material.c) \
  train/config.c train/config_text.c train/keys.c eval/set_ini.c $(FUZZ_C)
FUZZ_FLAGS := -O1 -g -fsanitize=address,undefined,fuzzer-no-link -fno-sanitize-recover=all
FUZZ_OBJ := $(FUZZED:%.c=$(BUILD)/fuzz/obj/%.o)

$(BUILD)/fuzz/obj/%.o: %.c $(BUILD)/gen/flags | $(BUILD)/gen/ops.h
	$(call step,CC,$< [fuzz])
	@mkdir -p $(@D)
	$(Q)$(FUZZ_CC) $(CPPFLAGS_ALL) $(PKG_CFLAGS) -std=c11 $(WARN) $(FUZZ_FLAGS) -MMD -MP -c -o $@ $<

$(BUILD)/fuzz/bin/%: tests/fuzz/main.c $(FUZZ_OBJ) $(INTERNAL)
	$(call step,LD,$@)
	@mkdir -p $(@D)
	$(Q)$(FUZZ_CC) $(CPPFLAGS_ALL) -std=c11 $(WARN) $(FUZZ_FLAGS) -fsanitize=fuzzer -DFUZZ_TARGET=fuzz_$* -o $@ \
	  $(filter %.c %.o %.a,$^) -rdynamic $(PKG_LIBS) -lpthread -ldl -lm

fuzz: $(FUZZ:%=$(BUILD)/fuzz/bin/%) $(IMAGE_LIB)
	@mkdir -p $(BUILD)/fuzz/lib/lgd && cp $(IMAGE_LIB) $(BUILD)/fuzz/lib/lgd
	@for t in $(FUZZ); do mkdir -p $(BUILD)/fuzz/$$t && echo "fuzz: $$t, $(FUZZ_SECONDS) s" && \
	  leaks=1 && limit=10 && if [ $$t = image ]; then leaks=0 && limit=300; fi && ASAN_OPTIONS=detect_leaks=$$leaks \
	  $(BUILD)/fuzz/bin/$$t -max_total_time=$(FUZZ_SECONDS) -timeout=$$limit -rss_limit_mb=2048 -max_len=16384 \
	  -print_final_stats=1 -artifact_prefix=$(BUILD)/fuzz/$$t. $(BUILD)/fuzz/$$t tests/corpus/$$t \
	  >$(BUILD)/fuzz/$$t.log 2>&1 || { tail -n 40 $(BUILD)/fuzz/$$t.log; exit 1; }; \
	  sed -n 's/^stat::number_of_executed_units: */fuzz: clean, inputs: /p' $(BUILD)/fuzz/$$t.log; done

tsan:
	@$(MAKE) --no-print-directory BUILD=$(BUILD)-tsan OPT='-O1 -g' SANITIZE=-fsanitize=thread programs
	@BUILD=$(BUILD)-tsan sh tests/tsan/run.sh

# The sanitizers' build lives beside the ordinary one.
asan:
	@ASAN_OPTIONS=allocator_may_return_null=1 $(MAKE) --no-print-directory BUILD=$(BUILD)-asan \
	  OPT='-O1 -g -fno-omit-frame-pointer' SANITIZE='-fsanitize=address,undefined -fno-sanitize-recover=all' test

demo: needs
	@$(MAKE) --no-print-directory programs
	@BUILD=$(BUILD) sh .ci/demo.sh

# What make install brings beside programs and libraries: made of the programs' --help.
ABOUT_infer := maps of a material from a flash photograph
ABOUT_train := trains the networks of lgd
ABOUT_eval := measures and compares estimates of materials
ABOUT_data := writes procedural materials and photographs of them
ABOUT_convert := converts and lists files of weights
ABOUT_capture := prints sheets to photograph materials with and checks photographs
MAN := $(PROGRAMS:%=share/man/man1/lgd-%.1)
COMPLETIONS := $(PROGRAMS:%=share/bash-completion/completions/lgd-%) $(PROGRAMS:%=share/zsh/site-functions/_lgd-%)

$(BUILD)/share/man/man1/lgd-%.1: $(BUILD)/bin/lgd-% Makefile
	$(call step,MAN,$@)
	@mkdir -p $(@D)
	$(Q)LC_ALL=C.UTF-8 help2man --no-info --name '$(ABOUT_$*)' --output $@ $<

$(BUILD)/share/bash-completion/completions/lgd-%: $(BUILD)/bin/lgd-% .ci/completions.sh
	$(call step,GEN,$@)
	@mkdir -p $(@D)
	$(Q)sh .ci/completions.sh bash $< > $@.new && mv $@.new $@

$(BUILD)/share/zsh/site-functions/_lgd-%: $(BUILD)/bin/lgd-% .ci/completions.sh
	$(call step,GEN,$@)
	@mkdir -p $(@D)
	$(Q)sh .ci/completions.sh zsh $< > $@.new && mv $@.new $@

manuals:
	@$(MAKE) --no-print-directory $(COMPLETIONS:%=$(BUILD)/%)
	@if sh .ci/deps.sh help2man; then $(MAKE) --no-print-directory $(MAN:%=$(BUILD)/%); \
	  else echo "make: manual pages are left out: they need help2man" >&2; fi

# Where make install puts things.
TO := $(DESTDIR)$(PREFIX)
TO_LIB := $(DESTDIR)$(LIBDIR)
MODELS := $(wildcard models/*.safetensors)

install: all
	@$(MAKE) --no-print-directory manuals
	install -d $(TO)/bin $(TO_LIB)/pkgconfig $(TO_LIB)/lgd $(TO)/include $(TO)/share/lgd
	install -m 755 $(BIN) $(TO)/bin
	install -m 644 $(LIB) $(SHARED) $(TO_LIB)
	ln -sf $(notdir $(SHARED)) $(TO_LIB)/$(SONAME)
	ln -sf $(SONAME) $(TO_LIB)/liblgd.so
	install -m 644 $(IMAGE_LIB) $(MPI_LIBS) $(TO_LIB)/lgd
	$(STRIP) --remove-section=.comment --remove-section=.note $(BIN:$(BUILD)/%=$(TO)/%)
	$(STRIP) --strip-unneeded --remove-section=.comment --remove-section=.note \
	  $(TO_LIB)/$(notdir $(SHARED)) $(TO_LIB)/lgd/*.so
	$(STRIP) --strip-debug $(TO_LIB)/liblgd.a
	install -m 644 infer/lgd.h $(TO)/include
	for f in $(MAN) $(COMPLETIONS); do \
	  [ ! -e $(BUILD)/$$f ] || install -D -m 644 $(BUILD)/$$f $(TO)/$$f || exit 1; done
	install -m 644 $(MODELS) $(TO)/share/lgd
	@printf '%s\n' 'prefix=$(PREFIX)' 'libdir=$(LIBDIR:$(PREFIX)/%=$${prefix}/%)' 'Name: lgd' \
	  'Description: material of a surface from one flash photograph' 'Version: $(VERSION)' \
	  'Cflags: -I$${prefix}/include' 'Libs: -L$${libdir} -llgd' \
	  'Libs.private: $(PKG_LIBS) -lpthread -ldl -lm' > $(TO_LIB)/pkgconfig/lgd.pc
	@chmod 644 $(TO_LIB)/pkgconfig/lgd.pc # whatever the umask is
	@[ -n "$(DESTDIR)" ] || ldconfig 2>/dev/null || true # the loader's list of libraries, where we may write it

uninstall:
	rm -f $(PROGRAMS:%=$(TO)/bin/lgd-%) $(TO_LIB)/liblgd.a $(TO_LIB)/liblgd.so* $(TO_LIB)/lgd/liblgd_*.so \
	  $(TO_LIB)/pkgconfig/lgd.pc $(TO)/include/lgd.h $(MODELS:models/%=$(TO)/share/lgd/%) \
	  $(MAN:%=$(TO)/%) $(COMPLETIONS:%=$(TO)/%)
	-rmdir $(TO)/share/lgd $(TO_LIB)/lgd

clean:
	rm -rf $(BUILD) $(BUILD)-asan $(BUILD)-leaks $(BUILD)-tsan

.PHONY: all needs programs library help deps test test-folders test-blender wheel blender manuals deb bench bench-deps \
  stress fuzz faults tsan asan demo install uninstall clean
.SECONDARY:
.DELETE_ON_ERROR:
-include $(shell find $(OBJ) $(BUILD)/fuzz/obj -name '*.d' 2>/dev/null)
