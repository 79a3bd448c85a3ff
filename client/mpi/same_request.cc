// SPDX-License-Identifier: Apache-2.0
#include "client/mpi/same_request.h"

#include <fmt/format.h>
#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream.h>
#include <google/protobuf/message.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <utility>

#include "client/files/json_text.h"

namespace dlcs::client {
namespace {

using google::protobuf::Message;

std::uint64_t Combined(std::uint64_t hash, std::string_view text) {
  constexpr std::uint64_t kFactor = 0x9e3779b97f4a7c15;  // odd
  return (hash ^ std::hash<std::string_view>()(text)) * kFactor;
}

// Keeps of what is written to it a hash alone.
class HashStream final : public google::protobuf::io::ZeroCopyOutputStream {
 public:
  bool Next(void** data, int* size) override {
    if (used_ == block_.size()) {
      hash_ = Combined(hash_, {block_.data(), used_});
      used_ = 0;
    }
    *data = block_.data() + used_;
    *size = static_cast<int>(block_.size() - used_);
    count_ += *size;
    used_ = block_.size();
    return true;
  }
  void BackUp(int count) override {
    used_ -= static_cast<std::size_t>(count);
    count_ -= count;
  }
  std::int64_t ByteCount() const override { return count_; }

  std::uint64_t Finish() const { return Combined(hash_, {block_.data(), used_}); }

 private:
  static constexpr std::size_t kBytes = std::size_t{1} << 16;

  std::array<char, kBytes> block_;
  std::size_t used_ = 0;
  std::int64_t count_ = 0;
  std::uint64_t hash_ = 0;
};

std::uint64_t HashOf(const Message& message) {
  HashStream stream;
  {
    google::protobuf::io::CodedOutputStream coded(&stream);
    coded.SetSerializationDeterministic(true);
    message.SerializePartialToCodedStream(&coded);
  }
  return stream.Finish();
}

std::uint64_t HashOf(v1::SolveOptions options) {
  options.clear_threads();
  return HashOf(static_cast<const Message&>(options));
}

}  // namespace

bool HaveSameText(const std::string& path, MpiTeam& team) {
  const auto text = ReadTextFile(path);
  const bool all_read = !team.Any(!text.ok());
  return team.IsSame(text.ok() ? std::hash<std::string>()(*text) : 0) && all_read;
}

absl::Status CheckSameOptions(const SolveCommand& command, MpiTeam& team) {
  std::uint64_t hash = Combined(HashOf(command.options), command.output);
  hash = Combined(hash, fmt::format("{}", static_cast<int>(command.format)));
  if (team.IsSame(hash)) return absl::OkStatus();
  return absl::InvalidArgumentError("the ranks were given different options; all must have the same");
}

absl::Status CheckSameRequest(const v1::SolveRequest& request, MpiTeam& team) {
  const v1::Problem& problem = request.problem();
  const auto bytes_of = [](const auto& numbers) {
    return std::string_view(reinterpret_cast<const char*>(numbers.data()),
                            sizeof(double) * static_cast<std::size_t>(numbers.size()));
  };
  const std::array<double, 1> horizon = {problem.horizon()};
  const std::pair<const char*, std::uint64_t> parts[] = {
      {"A", HashOf(problem.a())},
      {"B", HashOf(problem.b())},
      {"N", HashOf(problem.n())},
      {"M", HashOf(problem.m())},
      {"E", HashOf(problem.e())},
      {"x0 or T", Combined(Combined(0, bytes_of(problem.x0())), bytes_of(horizon))},
      {"f", HashOf(problem.f())},
      {"g", HashOf(problem.g())},
      {"something else", request.has_nonlinear() ? HashOf(request.nonlinear()) : HashOf(problem)},
      {"options", HashOf(request.options())},
  };
  std::string differing;
  for (const auto& [name, hash] : parts) {
    if (!team.IsSame(hash) && differing.empty()) differing = name;
  }
  if (differing.empty()) return absl::OkStatus();
  return absl::FailedPreconditionError("the processes of this solve have read different problems: " + differing +
                                       " is not the same in all of them");
}

absl::Status CheckSameEnsemble(const v1::SolveEnsembleRequest& request, MpiTeam& team) {
  const bool same_problem = team.IsSame(Combined(HashOf(request.problem()), request.problem_name()));
  const bool same_options = team.IsSame(HashOf(request.options()));
  std::uint64_t members = 0;
  for (const v1::EnsembleMember& member : request.members()) {
    const std::uint64_t hash = HashOf(member);
    members = Combined(members, {reinterpret_cast<const char*>(&hash), sizeof hash});
  }
  const bool same_members = team.IsSame(members);
  if (same_problem && same_options && same_members) return absl::OkStatus();
  return absl::FailedPreconditionError(
      fmt::format("the processes of this ensemble have read different {}", !same_problem   ? "problems"
                                                                           : !same_members ? "members"
                                                                                           : "options"));
}

}  // namespace dlcs::client
