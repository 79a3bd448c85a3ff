# SPDX-License-Identifier: Apache-2.0
# COIN-OR's linear programming solver as Clp::Clp; it has no package file of its own. Installed with dlcs, whose static
# library needs it where it is linked.
#
# With Clp_USE_STATIC_LIBS the static libraries, and the reference LAPACK, are preferred. The shared ones load whatever
# LAPACK the system has: OpenBLAS takes 8 ms and starts threads before a program does.
find_path(Clp_INCLUDE_DIR ClpSimplex.hpp PATH_SUFFIXES coin)
find_library(Clp_LIBRARY Clp)
find_library(Clp_UTILS_LIBRARY CoinUtils)
find_library(Clp_STATIC_LIBRARY libClp.a)
find_library(Clp_UTILS_STATIC_LIBRARY libCoinUtils.a)
find_library(Clp_LAPACK_STATIC_LIBRARY liblapack.a PATH_SUFFIXES lapack)
find_library(Clp_BLAS_STATIC_LIBRARY libblas.a PATH_SUFFIXES blas)
find_library(Clp_FORTRAN_LIBRARY NAMES gfortran libgfortran.so.5)
find_library(Clp_BZIP2_LIBRARY bz2)
find_library(Clp_ZLIB_LIBRARY z)
set(Clp_STATIC_LIBRARIES
  Clp_STATIC_LIBRARY Clp_UTILS_STATIC_LIBRARY Clp_LAPACK_STATIC_LIBRARY Clp_BLAS_STATIC_LIBRARY Clp_FORTRAN_LIBRARY
  Clp_BZIP2_LIBRARY Clp_ZLIB_LIBRARY)
mark_as_advanced(Clp_INCLUDE_DIR Clp_LIBRARY Clp_UTILS_LIBRARY ${Clp_STATIC_LIBRARIES})

include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(Clp REQUIRED_VARS Clp_LIBRARY Clp_UTILS_LIBRARY Clp_INCLUDE_DIR)

if(Clp_FOUND AND NOT TARGET Clp::Clp)
  set(Clp_LIBRARIES)
  foreach(library IN LISTS Clp_STATIC_LIBRARIES)
    list(APPEND Clp_LIBRARIES ${${library}})
  endforeach()
  if(NOT Clp_USE_STATIC_LIBS OR Clp_LIBRARIES MATCHES "-NOTFOUND")
    set(Clp_LIBRARIES ${Clp_LIBRARY} ${Clp_UTILS_LIBRARY})
  endif()
  add_library(Clp::Clp INTERFACE IMPORTED)
  set_target_properties(Clp::Clp PROPERTIES
    INTERFACE_INCLUDE_DIRECTORIES "${Clp_INCLUDE_DIR}"
    INTERFACE_LINK_LIBRARIES "${Clp_LIBRARIES}")
endif()
