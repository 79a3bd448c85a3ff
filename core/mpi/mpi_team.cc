// SPDX-License-Identifier: Apache-2.0
#include "core/mpi/mpi_team.h"

#include <algorithm>
#include <utility>

namespace dlcs {

MpiTeam::MpiTeam(MPI_Comm communicator) : communicator_(communicator) {
  MPI_Comm_rank(communicator_, &rank_);
  MPI_Comm_size(communicator_, &size_);
}

void MpiTeam::Share(int owner, double* values, Index count) {
  constexpr Index kAtOnce = Index{1} << 27;  // counts of MPI are int
  for (Index begin = 0; begin < count; begin += kAtOnce) {
    MPI_Bcast(values + begin, static_cast<int>(std::min(kAtOnce, count - begin)), MPI_DOUBLE, owner, communicator_);
  }
  Gather(0);  // for requests to stop
}

std::vector<double> MpiTeam::Gather(double value) {
  struct Part {
    double value, wants_stop;
  };
  constexpr int kNumbers = sizeof(Part) / sizeof(double);
  const Part own = {value, wanted_.stop_requested() ? 1.0 : 0.0};
  std::vector<Part> parts(static_cast<std::size_t>(size_));
  MPI_Allgather(&own, kNumbers, MPI_DOUBLE, parts.data(), kNumbers, MPI_DOUBLE, communicator_);
  std::vector<double> values;
  values.reserve(parts.size());
  for (const Part& part : parts) {
    values.push_back(part.value);
    if (part.wants_stop != 0) agreed_.request_stop();
  }
  return values;
}

std::vector<std::string> MpiTeam::CollectTexts(const std::string& own) {
  static constexpr std::size_t kAtOnce = std::size_t{1} << 30;  // counts of MPI are int
  constexpr int kTag = 2;
  const std::vector<double> sizes = Gather(static_cast<double>(own.size()));
  const auto each_block = [](std::size_t size, const auto& body) {
    for (std::size_t begin = 0; begin < size; begin += kAtOnce) {
      body(begin, static_cast<int>(std::min(kAtOnce, size - begin)));
    }
  };
  if (rank_ > 0) {
    each_block(own.size(), [&](std::size_t begin, int count) {
      MPI_Send(own.data() + begin, count, MPI_CHAR, 0, kTag, communicator_);
    });
    return {};
  }
  std::vector<std::string> texts = {own};
  for (int from = 1; from < size_; ++from) {
    std::string& text = texts.emplace_back();
    text.resize(static_cast<std::size_t>(sizes[static_cast<std::size_t>(from)]));
    each_block(text.size(), [&](std::size_t begin, int count) {
      MPI_Recv(text.data() + begin, count, MPI_CHAR, from, kTag, communicator_, MPI_STATUS_IGNORE);
    });
  }
  return texts;
}

std::string MpiTeam::TextOf(int owner, std::string own) {
  constexpr std::size_t kAtOnce = std::size_t{1} << 30;  // counts of MPI are int
  auto size = static_cast<unsigned long long>(own.size());
  MPI_Bcast(&size, 1, MPI_UNSIGNED_LONG_LONG, owner, communicator_);
  own.resize(size);
  for (std::size_t begin = 0; begin < own.size(); begin += kAtOnce) {
    const auto count = static_cast<int>(std::min(kAtOnce, own.size() - begin));
    MPI_Bcast(own.data() + begin, count, MPI_CHAR, owner, communicator_);
  }
  return own;
}

std::string MpiTeam::FirstText(const std::string& own) {
  const std::vector<double> has_text = Gather(own.empty() ? 0 : 1);
  const auto first = std::find(has_text.begin(), has_text.end(), 1.0);
  return first == has_text.end() ? "" : TextOf(static_cast<int>(first - has_text.begin()), own);
}

std::stop_token MpiTeam::Agreed(std::stop_token own) {
  wanted_ = std::move(own);
  agreed_ = std::stop_source();
  return agreed_.get_token();
}

}  // namespace dlcs
