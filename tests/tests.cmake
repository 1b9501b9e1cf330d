find_package(GTest REQUIRED)
include(GoogleTest)

archetide_precompile(archetide_test_headers <gtest/gtest.h>)
if(ARCHETIDE_PCH)
  target_link_libraries(archetide_test_headers PRIVATE GTest::gtest)
endif()

# Seconds that a fast test may take; programs that check themselves are up to thirty times as slow.
set(archetide_fast_limit 600)
if(ARCHETIDE_SANITIZE)
  set(archetide_fast_limit 6000)
endif()

# All *_test.cpp in tests/<kind>/<folder>/ and in its rooms become one executable test_<kind>_<folder>, linked to `libs`.
# Test cases whose suite name begins with "Slow" carry the label "slow", all others "fast".
function(archetide_tests name folder)
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS ${CMAKE_SOURCE_DIR}/tests/${folder}/*_test.cpp)
  if(NOT sources)
    return()
  endif()
  add_executable(${name} ${sources})
  target_link_libraries(${name} PRIVATE ${ARGN} GTest::gtest_main)
  archetide_use_precompiled(${name} archetide_test_headers)
  gtest_discover_tests(${name} TEST_FILTER "-Slow*" NO_PRETTY_VALUES PROPERTIES LABELS fast
                       TIMEOUT ${archetide_fast_limit}
                       DISCOVERY_TIMEOUT 60)
  gtest_discover_tests(${name} TEST_FILTER "Slow*" NO_PRETTY_VALUES PROPERTIES LABELS slow TIMEOUT 7200
                       DISCOVERY_TIMEOUT 60)
endfunction()

if(EXISTS ${CMAKE_SOURCE_DIR}/tests/support)
  archetide_library(archetide_test_support tests/support archetide_simulation)
endif()
archetide_tests(test_unit_common unit/common archetide_common)
archetide_tests(test_unit_grid unit/grid archetide_grid)
archetide_tests(test_unit_numerics unit/numerics archetide_numerics)
archetide_tests(test_unit_fluid unit/fluid archetide_fluid archetide_test_support)
archetide_tests(test_unit_solid unit/solid archetide_solid archetide_test_support)
archetide_tests(test_unit_contact unit/contact archetide_contact archetide_test_support)
archetide_tests(test_unit_articulation unit/articulation archetide_articulation archetide_test_support)
archetide_tests(test_unit_cut_cells unit/cut_cells archetide_cut_cells archetide_test_support)
archetide_tests(test_unit_pressure unit/pressure archetide_pressure archetide_test_support)
archetide_tests(test_unit_coupling unit/coupling archetide_coupling archetide_test_support)
archetide_tests(test_unit_scene unit/scene archetide_scene)
archetide_tests(test_unit_output unit/output archetide_output archetide_test_support)
# What bench_paper makes of run folders.
set(paper ${CMAKE_SOURCE_DIR}/tests/bench/frame_costs.cpp ${CMAKE_SOURCE_DIR}/tests/bench/paper/paper_scenes.cpp
    ${CMAKE_SOURCE_DIR}/tests/bench/paper/paper_run.cpp ${CMAKE_SOURCE_DIR}/tests/bench/paper/paper_page.cpp)
target_sources(test_unit_output PRIVATE ${CMAKE_SOURCE_DIR}/tests/scorecard/measurements_page.cpp ${paper})
archetide_tests(test_unit_bench unit/bench archetide_sweeps)
add_dependencies(test_unit_bench archetide-sim)
target_compile_definitions(test_unit_bench PRIVATE ARCHETIDE_SIM_BIN="$<TARGET_FILE:archetide-sim>")
archetide_tests(test_architecture architecture archetide_flags)
if(TARGET archetide_precompute)
  archetide_tests(test_unit_precompute unit/precompute archetide_precompute)
  target_link_libraries(test_unit_precompute PRIVATE PkgConfig::HDF5)
  add_dependencies(test_unit_precompute archetide-precompute)
  target_compile_definitions(test_unit_precompute PRIVATE
                             ARCHETIDE_CORPUS="${CMAKE_SOURCE_DIR}/tests/fuzz/corpus"
                             ARCHETIDE_SOURCES="${CMAKE_SOURCE_DIR}")
  set_source_files_properties(tests/unit/precompute/interrupt_test.cpp
    tests/unit/precompute/command_line_test.cpp PROPERTIES COMPILE_DEFINITIONS
    ARCHETIDE_PRECOMPUTE_BIN="$<TARGET_FILE:archetide-precompute>")
endif()
if(TARGET archetide_precompute)
  archetide_tests(test_statics statics archetide_precompute)
  target_compile_definitions(test_statics PRIVATE ARCHETIDE_ASSETS="${CMAKE_SOURCE_DIR}/assets")
  archetide_tests(test_nonlinear nonlinear archetide_precompute archetide_solid)
  archetide_tests(test_ladder ladder archetide_precompute archetide_test_support)
  target_compile_definitions(test_ladder PRIVATE ARCHETIDE_ASSETS="${CMAKE_SOURCE_DIR}/assets")
endif()
archetide_tests(test_analytic analytic archetide_scene archetide_test_support)
archetide_tests(test_hard hard archetide_scene archetide_test_support)
archetide_tests(test_scenes scenes archetide_scene archetide_output archetide_test_support)
if(TARGET test_scenes)
  add_dependencies(test_scenes archetide-sim)
  set_source_files_properties(tests/scenes/resume_test.cpp PROPERTIES COMPILE_DEFINITIONS
    ARCHETIDE_SIM_BIN="$<TARGET_FILE:archetide-sim>")
  if(TARGET archetide-precompute)
    add_dependencies(test_scenes archetide-precompute)
    set(programs "ARCHETIDE_SIM_BIN=\"$<TARGET_FILE:archetide-sim>\""
                 "ARCHETIDE_PRECOMPUTE_BIN=\"$<TARGET_FILE:archetide-precompute>\""
                 "ARCHETIDE_ASSETS=\"${CMAKE_SOURCE_DIR}/assets\"")
    set_source_files_properties(tests/scenes/full_modes_test.cpp tests/scenes/paper_scenes_test.cpp
      tests/scenes/resting_scenes_test.cpp tests/scenes/gauge_scenes_test.cpp
      PROPERTIES COMPILE_DEFINITIONS "${programs}")
  endif()
endif()

# Readers of all inputs: their corpora are read again by a fast test; with ARCHETIDE_FUZZ each target is a fuzzer too.
# The readers of precompute/ need none of its libraries.
add_library(archetide_fuzz_targets STATIC
  tests/fuzz/text_targets.cpp tests/fuzz/stored_targets.cpp tests/fuzz/field_edits.cpp
  precompute/recipe.cpp precompute/intake/regions.cpp precompute/intake/tet_io.cpp precompute/intake/vtu_read.cpp
  precompute/intake/msh_read.cpp precompute/intake/medit_read.cpp precompute/intake/repair_names.cpp)
target_link_libraries(archetide_fuzz_targets PUBLIC archetide_scene archetide_test_support)
archetide_use_precompiled(archetide_fuzz_targets archetide_headers)
archetide_tests(test_fuzz fuzz archetide_fuzz_targets)
target_compile_definitions(test_fuzz PRIVATE ARCHETIDE_CORPUS="${CMAKE_SOURCE_DIR}/tests/fuzz/corpus")
if(ARCHETIDE_FUZZ)
  file(GLOB corpora RELATIVE ${CMAKE_SOURCE_DIR}/tests/fuzz/corpus ${CMAKE_SOURCE_DIR}/tests/fuzz/corpus/*)
  foreach(target ${corpora})
    add_executable(fuzz_${target} tests/fuzz/fuzzer_main.cpp)
    target_compile_definitions(fuzz_${target} PRIVATE ARCHETIDE_FUZZ_TARGET="${target}")
    target_link_libraries(fuzz_${target} PRIVATE archetide_fuzz_targets -fsanitize=fuzzer)
    list(APPEND fuzzers fuzz_${target})
  endforeach()
  add_custom_target(fuzzers DEPENDS ${fuzzers})
endif()

# What happens to the programs when the world fails, and with mistakes in their words: pipeline.mk's faults and mutate.
add_library(archetide_strange_system MODULE tests/faults/strange_system.cpp)
add_executable(faults tests/faults/main.cpp tests/faults/process.cpp tests/faults/workshop.cpp
  tests/faults/kill_rows.cpp tests/faults/signal_rows.cpp tests/faults/machine_rows.cpp tests/faults/environment_rows.cpp)
target_link_libraries(faults PRIVATE archetide_flags)
target_compile_definitions(faults PRIVATE ARCHETIDE_STRANGE_SYSTEM="$<TARGET_FILE:archetide_strange_system>")
add_dependencies(faults archetide_strange_system)
add_executable(mutate tests/faults/mutate.cpp tests/faults/process.cpp)
target_link_libraries(mutate PRIVATE archetide_flags)

# Programs that print measured figures (named in tests/bench/benches.txt); built with the rest so that they do not rot.
function(archetide_bench name)
  add_executable(${name} ${CMAKE_SOURCE_DIR}/tests/bench/${name}.cpp)
  target_link_libraries(${name} PRIVATE ${ARGN})
  archetide_use_precompiled(${name} archetide_headers)
endfunction()
archetide_bench(bench_pressure_solve archetide_numerics)
archetide_bench(bench_coupled_solve archetide_test_support)
find_path(HYPRE_INCLUDE_DIR HYPRE_struct_ls.h PATH_SUFFIXES hypre)
find_library(HYPRE_LIBRARY HYPRE)
find_package(MPI QUIET COMPONENTS CXX)
if(HYPRE_INCLUDE_DIR AND HYPRE_LIBRARY AND MPI_CXX_FOUND)
  target_sources(bench_coupled_solve PRIVATE ${CMAKE_SOURCE_DIR}/tests/bench/pfmg.cpp)
  target_include_directories(bench_coupled_solve SYSTEM PRIVATE ${HYPRE_INCLUDE_DIR} ${MPI_CXX_INCLUDE_DIRS})
  target_link_libraries(bench_coupled_solve PRIVATE ${HYPRE_LIBRARY} ${MPI_CXX_LIBRARIES})
  target_compile_definitions(bench_coupled_solve PRIVATE ARCHETIDE_HYPRE)
else()
  message(STATUS "bench_coupled_solve: no comparison with PFMG (hypre or MPI not found; Debian: libhypre-dev)")
endif()
archetide_bench(bench_advection archetide_fluid)
if(TARGET archetide_precompute)
  archetide_library(archetide_elastic_cases tests/support/elastic archetide_precompute archetide_test_support)
  archetide_bench(bench_precompute archetide_elastic_cases)
endif()
archetide_bench(bench_body_step archetide_test_support)
archetide_bench(bench_contact archetide_test_support)
archetide_bench(bench_figure11 archetide_output)
target_sources(bench_figure11 PRIVATE ${CMAKE_SOURCE_DIR}/tests/bench/frame_costs.cpp)
archetide_bench(bench_paper archetide_output)
target_sources(bench_paper PRIVATE ${paper})
archetide_bench(bench_drafts archetide_scene archetide_test_support)
archetide_bench(bench_water archetide_test_support)
archetide_bench(bench_step archetide_test_support)

# Every quantity with a known answer. The quick cases are a fast test; `make -f pipeline.mk scorecard` runs all.
set(scorecard tests/scorecard/main.cpp tests/scorecard/score.cpp tests/scorecard/reference_data.cpp
    tests/scorecard/measurements_page.cpp
    tests/scorecard/single_solve_scores.cpp tests/scorecard/water_scores.cpp
    tests/scorecard/dry_body_scores.cpp tests/scorecard/coupled_scores.cpp)
if(TARGET archetide_precompute)
  add_executable(scorecard ${scorecard} tests/scorecard/elastic_scores.cpp)
  target_link_libraries(scorecard PRIVATE archetide_elastic_cases)
else()
  add_executable(scorecard ${scorecard} tests/scorecard/no_elastic_scores.cpp)
endif()
target_link_libraries(scorecard PRIVATE archetide_test_support archetide_output)
archetide_use_precompiled(scorecard archetide_headers)
target_compile_definitions(scorecard PRIVATE
                           ARCHETIDE_REFERENCE="${CMAKE_SOURCE_DIR}/tests/analytic/reference")
add_test(NAME Scorecard.QuickRowsMeetTheirTargets
         COMMAND scorecard --quick -o ${CMAKE_BINARY_DIR}/scorecard_quick.csv)
# The longest: begins first, or the others have ended long before it.
set_tests_properties(Scorecard.QuickRowsMeetTheirTargets PROPERTIES LABELS fast TIMEOUT ${archetide_fast_limit} COST 1000)
