# What writing and drawing runs needs. Embree and libpng are optional: without them `render` says
# that it is off.
find_package(nlohmann_json 3.10 REQUIRED)
target_link_libraries(archetide_output PRIVATE nlohmann_json::nlohmann_json)

find_package(embree 3 QUIET)
if(embree_FOUND AND PNG_FOUND)
  target_compile_definitions(archetide_output PRIVATE ARCHETIDE_WITH_EMBREE)
  target_link_libraries(archetide_output PRIVATE embree)
else()
  message(STATUS "render: off (needs libembree-dev and libpng-dev)")
endif()
