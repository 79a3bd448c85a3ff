// SPDX-License-Identifier: Apache-2.0
// Reads numbers, vectors and matrices from a JSON object, and collects all errors.

#ifndef DLCS_CLIENT_FILES_JSON_READER_H_
#define DLCS_CLIENT_FILES_JSON_READER_H_

#include <cstddef>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "client/files/matrix_files.h"
#include "dlcs/v1/solver.pb.h"

namespace dlcs::client {

// If a value is wrong, the Read functions return nothing and record an error with path, value and rule ("x0[1] is a
// string ("abc"); must be a number"). `path` is the place of the value as the user would write it. Not thread-safe; one
// reader per file.
class JsonReader {
 public:
  // `source` is the file's name for messages.
  explicit JsonReader(std::string source, MatrixFiles matrix_files = {})
      : source_(std::move(source)), matrix_files_(std::move(matrix_files)) {}

  const std::string& source() const { return source_; }
  const MatrixFiles& matrix_files() const { return matrix_files_; }

  // Records that the value at `path` breaks a rule: "x0[1]", "is a string; must be a number".
  void Refuse(const std::string& path, const std::string& rule);

  // Records an error for every key of `object` that is not in `known`, with the nearest known one. `path` is empty at
  // the top level, where the keys of NoteKeys() are allowed too. The keys in `notes` are allowed but not listed in
  // messages.
  void RefuseUnknownKeys(const nlohmann::json& object, const std::vector<std::string>& known, const std::string& path,
                         const std::vector<std::string>& notes = {});

  // The value of a required key; null, with an error recorded, if it is missing.
  const nlohmann::json* Require(const nlohmann::json& object, const std::string& key, const std::string& rule);

  std::optional<double> ReadNumber(const nlohmann::json& value, const std::string& path);
  std::optional<std::string> ReadString(const nlohmann::json& value, const std::string& path);
  std::optional<std::vector<double>> ReadNumbers(const nlohmann::json& value, const std::string& path);
  // A list of rows of equal length with at least one entry. Entries may be strings if `may_have_formulas`.
  std::optional<v1::DenseMatrix> ReadMatrix(const nlohmann::json& value, const std::string& path,
                                            bool may_have_formulas = false);
  // A number; or a formula, for which it sets `formula` and returns 0.
  std::optional<double> ReadEntry(const nlohmann::json& value, const std::string& path, std::string& formula);
  // One of `words`; for another word the error proposes the nearest one.
  std::optional<std::string> ReadWord(const nlohmann::json& value, const std::string& path,
                                      const std::vector<std::string>& words);
  // "auto", "unique", ...
  std::optional<v1::SolutionRule> ReadRule(const nlohmann::json& value, const std::string& path);

  // OK, or InvalidArgument with one "source: path rule" per line. Errors after the 20th are only counted.
  absl::Status status() const;

 private:
  std::string source_;
  MatrixFiles matrix_files_;
  std::vector<std::string> refusals_;
  std::size_t more_ = 0;  // errors that are only counted
};

// The keys that every file may have at the top level: its name, description, origin and schema.
const std::vector<std::string>& NoteKeys();

// A short description of `value`: "a string ("abc")", "a list (of 3)", "a number (4)".
std::string DescribeJson(const nlohmann::json& value);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_FILES_JSON_READER_H_
