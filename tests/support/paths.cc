// SPDX-License-Identifier: Apache-2.0
#include "tests/support/paths.h"

namespace dlcs::testing {
namespace {

std::string Quoted(const std::string& path) { return "'" + path + "'"; }

}  // namespace

std::string ProjectPath(const std::string& name) { return DLCS_PROJECT_DIR "/" + name; }
std::string CasePath(const std::string& name) { return ProjectPath("tests/cases/" + name + ".json"); }
std::string ExamplePath(const std::string& name) { return ProjectPath("deploy/examples/" + name + ".json"); }

std::string QuotedCase(const std::string& name) { return Quoted(CasePath(name)); }
std::string QuotedExample(const std::string& name) { return Quoted(ExamplePath(name)); }

std::string DlcsProgram() { return DLCS_PROGRAM; }
std::string DlcsdProgram() { return DLCSD_PROGRAM; }

std::string PostgresFolder() { return DLCS_POSTGRES_DIR; }
std::string OpenblasFolder() { return DLCS_OPENBLAS_DIR; }

}  // namespace dlcs::testing
