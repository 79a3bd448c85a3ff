#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Compiles by ccache; CMake calls this with the command of the compiler.
#
# Where a precompiled header is made again, ccache takes the old one for its content, and would find a header of other
# days: so the old one is removed first. With the two kinds of sloppiness ccache keeps objects that were compiled with
# precompiled headers.
for word; do
  case $word in
    *.gch) rm -f "$word" ;;
  esac
done
export CCACHE_SLOPPINESS=pch_defines,time_macros
exec ccache "$@"
