// SPDX-License-Identifier: Apache-2.0
// Problem files: one JSON object with the matrices and sources of a system, as problem.schema.json and
// nonlinear.schema.json describe; or an .npz or .mat file, as problem_arrays.h describes.

#ifndef DLCS_CLIENT_FILES_PROBLEM_FILE_H_
#define DLCS_CLIENT_FILES_PROBLEM_FILE_H_

#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "client/files/matrix_files.h"
#include "dlcs/v1/solver.pb.h"

namespace dlcs::client {

struct ProblemFile {
  v1::Problem problem;                            // empty if `nonlinear` is set
  std::optional<v1::NonlinearProblem> nonlinear;  // of a file with "kind": "nonlinear"
  std::string name;                               // the key `name`, empty when there is none
};

// Whether two functions of `size` components are equal for a problem. Implemented in client/local/agreement.h, since it
// needs the engine.
using AgreementCheck = std::function<bool(const v1::TimeFunction& one, const v1::TimeFunction& other, int size,
                                          const v1::Problem& problem)>;

// Reads the keys A B N M x0 T f g states pairs parameters pieces rule selector break_points outputs measurements and
// the annotations; of a nonlinear problem ("kind": "nonlinear") f g x0 T states pairs parameters W break_points, where
// f and g are lists of formulas in t, x1, ... and y1, ....
//
// Matrices take the forms of matrix_json.h, f and g those of time_function_json.h; a missing source is zero. `pieces`
// replaces both; f or g next to it is an error unless `agrees` says that they are equal. Only the format is checked
// here: types, equal row lengths, known keys. Shapes and formulas are checked by the engine, so that the messages are
// the same here and from a server.
//
// A text that is no JSON but begins as an .npz or .mat file does is read as one.
//
// `source` is the file's name for messages. `matrix_files`, if given, is asked first for matrices in files. Errors:
// InvalidArgument with one "source: place rule" per line.
absl::StatusOr<ProblemFile> ParseProblem(const std::string& text, const std::string& source,
                                         const AgreementCheck& agrees = {}, const MatrixFiles& matrix_files = {});

// The same for the file at `path`, `-` for standard input. Errors: as above and as ReadTextFile().
absl::StatusOr<ProblemFile> ReadProblemFile(const std::string& path, const AgreementCheck& agrees = {});

// The contents of a problem file that ParseProblem() reads as the valid `problem`; the structure of matrices is kept.
nlohmann::ordered_json ProblemJson(const v1::Problem& problem);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_FILES_PROBLEM_FILE_H_
