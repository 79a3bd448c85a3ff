# SPDX-License-Identifier: Apache-2.0
# Builds the web page with npm and writes its files as C++ (gateway/page_files.h). Where that is not possible the list
# is empty: dlcsd works without its page.
#
#     cmake -D NPM=/usr/bin/npm -D PROJECT=... -D WORK=folder -D OUT=page_files.cc -P page_files.cmake
cmake_minimum_required(VERSION 3.25)

# In WORK, so that nothing is written into the source tree.
set(files)
if(NPM AND EXISTS ${PROJECT}/client/page/package.json)
  file(MAKE_DIRECTORY ${WORK}/client ${WORK}/deploy ${WORK}/proto)
  file(COPY ${PROJECT}/client/page DESTINATION ${WORK}/client PATTERN node_modules EXCLUDE PATTERN dist EXCLUDE)
  file(GLOB schemas ${PROJECT}/client/*.schema.json)
  file(COPY ${schemas} DESTINATION ${WORK}/client)
  file(COPY ${PROJECT}/deploy/examples DESTINATION ${WORK}/deploy)
  file(COPY ${PROJECT}/proto/dlcs ${PROJECT}/proto/google DESTINATION ${WORK}/proto)
  set(page ${WORK}/client/page)
  set(dist ${WORK}/dist)
  file(REMOVE_RECURSE ${dist})
  set(log ${WORK}/npm.log)
  file(SHA256 ${page}/package-lock.json lock)
  set(installed)
  if(EXISTS ${WORK}/installed)
    file(READ ${WORK}/installed installed)
  endif()
  set(failed 0)
  if(NOT installed STREQUAL lock)
    execute_process(COMMAND ${NPM} ci --no-audit --no-fund --loglevel=error WORKING_DIRECTORY ${page}
                    OUTPUT_FILE ${log} ERROR_FILE ${log} RESULT_VARIABLE failed)
    if(failed EQUAL 0)
      file(WRITE ${WORK}/installed ${lock})
    endif()
  endif()
  if(failed EQUAL 0)
    execute_process(COMMAND ${NPM} run build --silent -- --out ${dist} WORKING_DIRECTORY ${page}
                    OUTPUT_FILE ${log} ERROR_FILE ${log} RESULT_VARIABLE failed)
  endif()
  if(failed EQUAL 0)
    file(GLOB files RELATIVE ${dist} ${dist}/*)
  else()
    message(WARNING "npm could not build the web page, so that dlcsd will have none; see ${log}")
  endif()
endif()

set(types_html "text/html; charset=utf-8")
set(types_js "text/javascript; charset=utf-8")
set(types_css "text/css; charset=utf-8")
set(types_svg "image/svg+xml")
set(types_json "application/json")
set(types_txt "text/plain; charset=utf-8")

set(arrays "")
set(entries "")
set(number 0)
foreach(file IN LISTS files)
  cmake_path(GET file EXTENSION LAST_ONLY extension)
  string(SUBSTRING "${extension}" 1 -1 extension)
  if(NOT DEFINED types_${extension})
    continue()
  endif()
  file(READ ${dist}/${file} bytes HEX)
  string(REGEX REPLACE "(..)" "0x\\1," bytes "${bytes}")
  string(APPEND arrays "constexpr unsigned char kFile${number}[] = {${bytes}};\n")
  set(path "/${file}")
  if(file STREQUAL "index.html")
    set(path "/")
  endif()
  string(APPEND entries "    {\"${path}\", \"${types_${extension}}\", View(kFile${number})},\n")
  math(EXPR number "${number} + 1")
endforeach()

set(text "// Made by server/gateway/page_files.cmake.\n#include \"server/gateway/page_files.h\"\n\nnamespace dlcs {\n")
if(number GREATER 0)
  string(APPEND text "namespace {\n${arrays}
template <std::size_t size>
std::string_view View(const unsigned char (&bytes)[size]) {
  return {reinterpret_cast<const char*>(bytes), size};
}

const PageFile kFiles[] = {
${entries}};
}  // namespace

std::span<const PageFile> PageFiles() { return kFiles; }
")
else()
  string(APPEND text "std::span<const PageFile> PageFiles() { return {}; }\n")
endif()
string(APPEND text "}  // namespace dlcs\n")
file(CONFIGURE OUTPUT ${OUT} CONTENT "${text}" @ONLY)
