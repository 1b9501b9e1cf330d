# archetide-precompute: surface mesh + recipe -> archetype. The only part that links CGAL, gmsh, ARPACK and SuiteSparse.
set(CGAL_DO_NOT_WARN_ABOUT_CMAKE_BUILD_TYPE TRUE)
find_package(CGAL REQUIRED)
find_library(GMSH_LIBRARY gmsh REQUIRED)
find_library(ARPACK_LIBRARY arpack REQUIRED)
find_library(CHOLMOD_LIBRARY cholmod REQUIRED)
find_library(METIS_LIBRARY metis REQUIRED)
find_library(OPENBLAS_LIBRARY openblas REQUIRED)
find_path(CHOLMOD_INCLUDE cholmod.h PATH_SUFFIXES suitesparse REQUIRED)

archetide_library(archetide_precompute precompute archetide_common)
target_include_directories(archetide_precompute SYSTEM PRIVATE ${CHOLMOD_INCLUDE})
# OpenBLAS stands before ARPACK and CHOLMOD so that both use it and not the reference BLAS.
target_link_libraries(archetide_precompute PRIVATE CGAL::CGAL ${OPENBLAS_LIBRARY} ${ARPACK_LIBRARY} ${CHOLMOD_LIBRARY}
                      ${METIS_LIBRARY} ${GMSH_LIBRARY} ${CMAKE_DL_LIBS})

add_executable(archetide-precompute precompute/main.cpp)
target_link_libraries(archetide-precompute PRIVATE archetide_precompute)
archetide_use_precompiled(archetide-precompute archetide_headers)
