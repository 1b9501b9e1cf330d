# ARCHETIDE_SANITIZE: compiles all of ours so that a run checks itself. `make -f pipeline.mk sanitize` and `fuzz` use it.
# The first error ends the program: no report is lost in a log.
if(ARCHETIDE_SANITIZE STREQUAL "address")
  set(archetide_checks -fsanitize=address,undefined -fno-sanitize-recover=all)
  if(CMAKE_CXX_COMPILER_ID MATCHES Clang)
    # Eigen 3.4 takes blocks of empty matrices (the modes of a rigid body) by adding to null.
    list(APPEND archetide_checks -fsanitize=float-cast-overflow -fno-sanitize=pointer-overflow)
  endif()
  if(ARCHETIDE_FUZZ)
    # Comparisons guide a fuzzer to the words and numbers of a format; in loops over cells they take half of the time.
    set(archetide_readers base params mesh files archetype scene fuzz_targets)
    list(TRANSFORM archetide_readers PREPEND archetide_)
    list(APPEND archetide_checks -fsanitize=fuzzer-no-link
         "$<$<NOT:$<IN_LIST:$<TARGET_PROPERTY:NAME>,${archetide_readers}>>:-fno-sanitize-coverage=trace-cmp>")
  endif()
elseif(ARCHETIDE_SANITIZE STREQUAL "thread")
  set(archetide_checks -fsanitize=thread)
elseif(ARCHETIDE_SANITIZE)
  message(FATAL_ERROR "ARCHETIDE_SANITIZE=${ARCHETIDE_SANITIZE}: choose address or thread")
endif()
if(ARCHETIDE_SANITIZE)
  target_compile_definitions(archetide_flags INTERFACE ARCHETIDE_SANITIZED)
  target_compile_options(archetide_flags INTERFACE ${archetide_checks} -O2 -g1 -fno-omit-frame-pointer)
  target_link_options(archetide_flags INTERFACE ${archetide_checks})
endif()
# Indices of std::vector and the like are checked where speed does not count.
if(ARCHETIDE_SANITIZE OR CMAKE_BUILD_TYPE STREQUAL "Debug")
  target_compile_definitions(archetide_flags INTERFACE _GLIBCXX_ASSERTIONS)
endif()
# The sources are written for the warnings of GCC, and no loop is fast without optimisation.
if(CMAKE_CXX_COMPILER_ID MATCHES Clang)
  target_compile_options(archetide_flags INTERFACE -Wno-unknown-warning-option -Wno-pass-failed)
endif()
