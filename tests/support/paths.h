// SPDX-License-Identifier: Apache-2.0
// The paths of files and programs that tests use. Paths differ between clones; only one small source file contains
// them, so that compiler caches serve all others.

#ifndef DLCS_TESTS_SUPPORT_PATHS_H_
#define DLCS_TESTS_SUPPORT_PATHS_H_

#include <string>

namespace dlcs::testing {

// A file of the project, named from its root: "tests/cases".
std::string ProjectPath(const std::string& name);
std::string CasePath(const std::string& name);     // tests/cases/NAME.json
std::string ExamplePath(const std::string& name);  // deploy/examples/NAME.json

// In single quotes, as a shell reads them.
std::string QuotedCase(const std::string& name);
std::string QuotedExample(const std::string& name);

// The programs that were built with the tests.
std::string DlcsProgram();
std::string DlcsdProgram();

// The folder of PostgreSQL's programs, which are not on the search path in Debian.
std::string PostgresFolder();
// The folder of a LAPACK that starts a thread when it is loaded.
std::string OpenblasFolder();

}  // namespace dlcs::testing

#endif  // DLCS_TESTS_SUPPORT_PATHS_H_
