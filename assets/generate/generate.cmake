# archetide-assets writes the surfaces of assets/bodies; a test holds the committed files to its output.
file(GLOB asset_sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_LIST_DIR}/*.cpp)
add_executable(archetide-assets ${asset_sources})
target_link_libraries(archetide-assets PRIVATE archetide_common)
# No fused multiply-adds: the same bytes whatever the machine's instruction set.
target_compile_options(archetide-assets PRIVATE -ffp-contract=off)
if(ARCHETIDE_TESTS)
  add_test(NAME Assets.CommittedSurfacesAreWhatTheGeneratorWrites
           COMMAND archetide-assets --check ${CMAKE_SOURCE_DIR}/assets/bodies)
  set_tests_properties(Assets.CommittedSurfacesAreWhatTheGeneratorWrites PROPERTIES LABELS fast
                       TIMEOUT 600)
endif()
