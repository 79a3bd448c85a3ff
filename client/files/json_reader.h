// SPDX-License-Identifier: Apache-2.0
// Takes a JSON object apart into numbers, vectors and matrices, and collects everything that is wrong with
// it.

#ifndef DLCS_CLIENT_FILES_JSON_READER_H_
#define DLCS_CLIENT_FILES_JSON_READER_H_

#include <cstddef>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "dlcs/v1/solver.pb.h"

namespace dlcs::client {

// Every Read function returns nothing when the value is not what it should be, having noted path, value and
// rule ("x0[1] is a string ("abc"); must be a number"). `path` is how the user would write the value's place.
// Not thread-safe; one reader per file.
class JsonReader {
 public:
  // `source` is the file's name for messages.
  explicit JsonReader(std::string source) : source_(std::move(source)) {}

  const std::string& source() const { return source_; }

  // Notes that `path` breaks a rule, both in the user's words: "x0[1]", "is a string; must be a number".
  void Refuse(const std::string& path, const std::string& rule);

  // Notes every key of `object` that is not `known`, with the nearest known one. `path` is empty at the top, where the
  // keys of NoteKeys() are known too. `notes` may stand there besides, and are not told.
  void RefuseUnknownKeys(const nlohmann::json& object, const std::vector<std::string>& known,
                         const std::string& path, const std::vector<std::string>& notes = {});

  // The value of a key that must be there, or null and a note.
  const nlohmann::json* Require(const nlohmann::json& object, const std::string& key,
                                const std::string& rule);

  std::optional<double> ReadNumber(const nlohmann::json& value, const std::string& path);
  std::optional<std::string> ReadString(const nlohmann::json& value, const std::string& path);
  std::optional<std::vector<double>> ReadNumbers(const nlohmann::json& value, const std::string& path);
  // A list of rows, all of one length, at least one entry. Texts are entries where `may_have_formulas`.
  std::optional<v1::DenseMatrix> ReadMatrix(const nlohmann::json& value, const std::string& path,
                                            bool may_have_formulas = false);
  // A number, or a formula, for which `formula` is set and 0 returned.
  std::optional<double> ReadEntry(const nlohmann::json& value, const std::string& path, std::string& formula);
  // One of `words`, with the nearest one where it is none of them.
  std::optional<std::string> ReadWord(const nlohmann::json& value, const std::string& path,
                                      const std::vector<std::string>& words);
  // "auto", "unique", ...
  std::optional<v1::SolutionRule> ReadRule(const nlohmann::json& value, const std::string& path);

  // OK, or InvalidArgument with one "source: path rule" per line. After 20 the rest is only counted.
  absl::Status status() const;

 private:
  std::string source_;
  std::vector<std::string> refusals_;
  std::size_t more_ = 0;  // refused beyond the ones that are kept
};

// What every file may say of itself at the top: its name, what it is about, where it comes from, its schema.
const std::vector<std::string>& NoteKeys();

// "a string ("abc")", "a list (of 3)", "a number (4)": what stands there, shortened.
std::string DescribeJson(const nlohmann::json& value);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_FILES_JSON_READER_H_
