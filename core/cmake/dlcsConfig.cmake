# SPDX-License-Identifier: Apache-2.0
# find_package(dlcs COMPONENTS core)     dlcs::core, the engine; needs neither gRPC nor protobuf
# find_package(dlcs COMPONENTS client)   dlcs::client, for programs that call a server
# Without components: all that is installed.
include(CMakeFindDependencyMacro)

set(dlcs_installed)
foreach(component IN ITEMS core client)
  if(EXISTS ${CMAKE_CURRENT_LIST_DIR}/dlcs-${component}.cmake)
    list(APPEND dlcs_installed ${component})
  endif()
endforeach()
if(NOT dlcs_FIND_COMPONENTS)
  set(dlcs_FIND_COMPONENTS ${dlcs_installed})
endif()

# The libraries are static: what they use must be found where they are linked.
if(core IN_LIST dlcs_FIND_COMPONENTS AND core IN_LIST dlcs_installed)
  find_dependency(Eigen3 3.4)
  find_dependency(TBB)
  find_dependency(absl)
  list(APPEND CMAKE_MODULE_PATH ${CMAKE_CURRENT_LIST_DIR})
  find_dependency(Clp)
  list(REMOVE_ITEM CMAKE_MODULE_PATH ${CMAKE_CURRENT_LIST_DIR})
  include(${CMAKE_CURRENT_LIST_DIR}/dlcs-core.cmake)
  set(dlcs_core_FOUND TRUE)
endif()
if(client IN_LIST dlcs_FIND_COMPONENTS AND client IN_LIST dlcs_installed)
  find_dependency(Protobuf) # the module, before gRPC: Debian's protobuf has no package file of its own
  find_dependency(gRPC CONFIG)
  find_dependency(absl)
  find_dependency(nlohmann_json)
  find_dependency(fmt)
  find_dependency(OpenSSL)
  find_dependency(ZLIB)
  find_dependency(PkgConfig)
  pkg_check_modules(libzip REQUIRED IMPORTED_TARGET libzip)
  include(${CMAKE_CURRENT_LIST_DIR}/dlcs-client.cmake)
  set(dlcs_client_FOUND TRUE)
endif()

foreach(component IN LISTS dlcs_FIND_COMPONENTS)
  if(dlcs_FIND_REQUIRED_${component} AND NOT dlcs_${component}_FOUND)
    set(dlcs_FOUND FALSE)
    set(dlcs_NOT_FOUND_MESSAGE "its component ${component} is not installed (installed: ${dlcs_installed})")
  endif()
endforeach()
