// SPDX-License-Identifier: Apache-2.0
#include "client/files/array_file.h"

#include <fmt/format.h>

#include <utility>

#include "client/files/json_text.h"
#include "client/files/mat_file.h"
#include "client/files/npy_array.h"
#include "client/files/npz_file.h"
#include "client/files/petsc_file.h"
#include "proto/shared/truncate_text.h"

namespace dlcs::client {
namespace {

// Of an archive with members, and of an empty one.
bool IsZip(std::string_view bytes) { return bytes.starts_with("PK\x03\x04") || bytes.starts_with("PK\x05\x06"); }

absl::StatusOr<StoredVariables> ParseByContent(std::string_view bytes, const Wanted& wanted) {
  ReadingBudget budget;
  if (IsZip(bytes)) return ParseNpz(bytes, wanted, budget);
  if (IsMatFile(bytes)) return ParseMat(bytes, wanted, budget);
  const bool is_petsc = IsPetscFile(bytes);
  if (!is_petsc && !bytes.starts_with(kNpyMagic)) {
    return absl::InvalidArgumentError(
        "is neither an .npy, an .npz nor a .mat file (of level 5, as save -v7 makes it), nor a matrix of PETSc");
  }
  StoredVariables variables;
  variables.names.emplace_back();
  if (wanted("")) variables.arrays.emplace("", is_petsc ? ParsePetsc(bytes, budget) : ParseNpy(bytes, budget));
  return variables;
}

// "A, B, N" of at most twenty names.
std::string Listed(const std::vector<std::string>& names) {
  constexpr std::size_t kMax = 20;
  std::string list;
  for (std::size_t k = 0; k < names.size() && k < kMax; ++k) {
    list += (k > 0 ? ", " : "") + TruncateUtf8(names[k], 40);
  }
  return names.size() > kMax ? fmt::format("{}, … {} in all", list, names.size()) : list;
}

}  // namespace

bool IsArrayFile(std::string_view bytes) {
  return IsZip(bytes) || IsMatFile(bytes) || IsPetscFile(bytes) || bytes.starts_with(kNpyMagic);
}

absl::StatusOr<StoredVariables> ParseArrayFile(std::string_view bytes, const std::string& source,
                                               const Wanted& wanted) {
  auto variables = ParseByContent(bytes, wanted);
  if (variables.ok()) return variables;
  return absl::Status(variables.status().code(),
                      fmt::format("{}: {}", source, std::string(variables.status().message())));
}

absl::StatusOr<StoredArray> ReadStoredArray(const std::string& path, const std::optional<std::string>& variable) {
  const auto bytes = ReadFileBytes(path);
  if (!bytes.ok()) return bytes.status();
  std::optional<std::string> name = variable;
  if (!name) {
    const auto listed = ParseArrayFile(*bytes, path, [](const std::string&) { return false; });
    if (!listed.ok()) return listed.status();
    if (listed->names.size() != 1) {
      return absl::InvalidArgumentError(fmt::format("{}: holds {} variables{}; \"variable\" must name one of them",
                                                    path, listed->names.size(),
                                                    listed->names.empty() ? "" : " (" + Listed(listed->names) + ")"));
    }
    name = listed->names.front();
  }
  auto variables = ParseArrayFile(*bytes, path, [&name](const std::string& one) { return one == *name; });
  if (!variables.ok()) return variables.status();
  const auto found = variables->arrays.find(*name);
  if (found == variables->arrays.end()) {
    const bool has_name = variables->names != std::vector<std::string>{""};
    return absl::NotFoundError(fmt::format("{}: has no variable \"{}\"; it holds {}", path, TruncateUtf8(*name, 40),
                                           has_name ? Listed(variables->names) : "one array without a name"));
  }
  if (found->second.ok()) return *std::move(found->second);
  return absl::Status(found->second.status().code(),
                      fmt::format("{}: {}{}{}", path, TruncateUtf8(*name, 40), name->empty() ? "" : " ",
                                  std::string(found->second.status().message())));
}

}  // namespace dlcs::client
