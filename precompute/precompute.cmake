# archetide-precompute: surface mesh + recipe -> archetype. The only part that links CGAL, gmsh, ARPACK and SuiteSparse.
set(CGAL_DO_NOT_WARN_ABOUT_CMAKE_BUILD_TYPE TRUE)
find_package(CGAL REQUIRED)
find_library(GMSH_LIBRARY gmsh REQUIRED)
find_library(ARPACK_LIBRARY arpack REQUIRED)
find_library(CHOLMOD_LIBRARY cholmod REQUIRED)
find_library(METIS_LIBRARY metis REQUIRED)
find_library(OPENBLAS_LIBRARY openblas REQUIRED)
find_path(CHOLMOD_INCLUDE cholmod.h PATH_SUFFIXES suitesparse REQUIRED)

archetide_library(archetide_precompute_base precompute/base archetide_common)
archetide_library(archetide_intake precompute/intake archetide_precompute_base)
target_link_libraries(archetide_intake PRIVATE CGAL::CGAL)
archetide_library(archetide_meshing precompute/meshing archetide_intake)
target_link_libraries(archetide_meshing PRIVATE CGAL::CGAL ${GMSH_LIBRARY})
archetide_library(archetide_modal precompute/modal archetide_precompute_base)
target_include_directories(archetide_modal SYSTEM PRIVATE ${CHOLMOD_INCLUDE})
# OpenBLAS stands before ARPACK and CHOLMOD so that both use it and not the reference BLAS.
target_link_libraries(archetide_modal PRIVATE ${OPENBLAS_LIBRARY} ${ARPACK_LIBRARY} ${CHOLMOD_LIBRARY} ${METIS_LIBRARY}
                      ${CMAKE_DL_LIBS})
archetide_library(archetide_inspect precompute/inspect archetide_meshing)
archetide_library(archetide_precompute precompute archetide_modal archetide_inspect)

archetide_library(archetide_precompute_commands precompute/commands archetide_precompute)

add_executable(archetide-precompute precompute/main.cpp)
target_link_libraries(archetide-precompute PRIVATE archetide_precompute_commands)
archetide_use_precompiled(archetide-precompute archetide_headers)
