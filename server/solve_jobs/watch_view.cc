// SPDX-License-Identifier: Apache-2.0
#include "server/solve_jobs/watch_view.h"

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <limits>
#include <numeric>

#include "fmt/format.h"
#include "google/protobuf/io/coded_stream.h"
#include "google/protobuf/io/zero_copy_stream_impl_lite.h"
#include "server/wire/errors.h"

namespace dlcs {
namespace {

constexpr std::size_t kSampledTimes = 65;
// As in a page of a trajectory: a quarter of what receivers accept by default.
constexpr std::size_t kMaxValues = 1'000'000 / sizeof(double);

// `count` of the numbers 0 .. size - 1, evenly spread, the last among them.
std::vector<std::size_t> Spread(std::size_t size, std::size_t count) {
  std::vector<std::size_t> chosen(std::min(size, count));
  const std::size_t gaps = std::max<std::size_t>(chosen.size(), 2) - 1;
  for (std::size_t k = 0; k < chosen.size(); ++k) {
    chosen[chosen.size() - 1 - k] = size - 1 - (k * (size - 1) + gaps / 2) / gaps;
  }
  return chosen;
}

// The tag of a field whose value is a length and as many bytes.
std::uint32_t TagOfBytes(int field) {
  constexpr std::uint32_t kLengthDelimited = 2;
  return static_cast<std::uint32_t>(field) << 3 | kLengthDelimited;
}

}  // namespace

absl::StatusOr<WatchView> WatchView::Create(const v1::WatchSolveJobRequest& request) {
  WatchView view;
  switch (request.view()) {
    case v1::WATCH_VIEW_UNSPECIFIED:
    case v1::WATCH_VIEW_RESIDUALS:
      break;
    case v1::WATCH_VIEW_PROGRESS:
      view.progress_only_ = true;
      break;
    case v1::WATCH_VIEW_SAMPLED:
      view.detail_.most_times = kSampledTimes;
      break;
    case v1::WATCH_VIEW_FULL:
      view.detail_.most_times = std::numeric_limits<std::size_t>::max();
      break;
    default:
      return InvalidRequest(
          {{"view", fmt::format("{}; this server does not know this view", static_cast<int>(request.view()))}});
  }
  if (request.y_components_size() > 0 && view.detail_.most_times == 0) {
    return InvalidRequest({{"y_components", fmt::format("{} given; only the views SAMPLED and FULL have values of y",
                                                        request.y_components_size())}});
  }
  for (int k = 0; k < request.y_components_size(); ++k) {
    const int component = request.y_components(k);
    if (component < 0) {
      return InvalidRequest({{fmt::format("y_components[{}]", k), fmt::format("{}; must be at least 0", component)}});
    }
  }
  view.components_.assign(request.y_components().begin(), request.y_components().end());
  view.detail_.components = view.components_;
  std::vector<int>& components = view.detail_.components;
  std::ranges::sort(components);
  components.erase(std::unique(components.begin(), components.end()), components.end());
  return view;
}

absl::Status WatchView::Admits(const v1::Analysis& analysis) const {
  for (std::size_t k = 0; k < components_.size(); ++k) {
    if (components_[k] < analysis.constraints()) continue;
    return InvalidRequest({{fmt::format("y_components[{}]", k),
                            fmt::format("{}; must be between 0 and {}", components_[k], analysis.constraints() - 1)}});
  }
  return absl::OkStatus();
}

void WatchView::Narrow(v1::Iterate& iterate) const {
  if (iterate.times().empty()) return;
  const auto size = static_cast<std::size_t>(iterate.times_size());
  if (components_.empty() && iterate.y_components().empty() && size <= detail_.most_times) return;  // wants all of it
  const auto rows = static_cast<std::size_t>(iterate.y_size()) / size;
  // Rows of the reported components, in the requested order.
  std::vector<std::size_t> wanted;
  if (components_.empty()) {
    wanted.resize(iterate.y_components().empty() ? rows : 0);
    std::iota(wanted.begin(), wanted.end(), std::size_t{0});
  }
  for (const int component : components_) {
    const auto& present = iterate.y_components();
    const auto at = std::lower_bound(present.begin(), present.end(), component);
    if (present.empty() && static_cast<std::size_t>(component) < rows) {
      wanted.push_back(static_cast<std::size_t>(component));
    } else if (at != present.end() && *at == component) {
      wanted.push_back(static_cast<std::size_t>(at - present.begin()));
    }
  }
  v1::Iterate narrow;
  const bool has_all = components_.empty() ? iterate.y_components().empty() : wanted.size() == components_.size();
  if (detail_.most_times > 0 && has_all) {
    for (const std::size_t column : Spread(size, detail_.most_times)) {
      narrow.add_times(iterate.times(static_cast<int>(column)));
      for (const std::size_t row : wanted) narrow.add_y(iterate.y(static_cast<int>(column * rows + row)));
    }
    narrow.mutable_y_components()->Add(components_.begin(), components_.end());
  }
  iterate.mutable_times()->Swap(narrow.mutable_times());
  iterate.mutable_y()->Swap(narrow.mutable_y());
  iterate.mutable_y_components()->Swap(narrow.mutable_y_components());
}

void AppendValues(const IterateValues& values, const jobs::EventDetail& detail, std::string& event) {
  if (detail.most_times == 0) return;
  const auto n = static_cast<int>(values.y.rows());
  // Requests for components that the problem does not have are refused by WatchView::Admits().
  const auto& all = detail.components;
  const std::vector<int> rows(all.begin(), std::ranges::lower_bound(all, n));
  if (all.empty() ? n == 0 : rows.empty()) return;
  const std::size_t size = all.empty() ? static_cast<std::size_t>(n) : rows.size();
  const std::size_t most = std::min(detail.most_times, std::max<std::size_t>(kMaxValues / size, 1));
  const std::vector<std::size_t> columns = Spread(values.times.size(), most);
  v1::Iterate others;
  for (const std::size_t column : columns) others.add_times(values.times[column]);
  others.mutable_y_components()->Add(rows.begin(), rows.end());
  const std::string times = others.SerializeAsString();

  using google::protobuf::io::CodedOutputStream;
  static_assert(std::endian::native == std::endian::little, "doubles are copied as they are");
  const auto y_bytes = static_cast<std::uint32_t>(columns.size() * size * sizeof(double));
  const std::size_t head_bytes = 1 + CodedOutputStream::VarintSize32(y_bytes);
  const auto bytes = static_cast<std::uint32_t>(times.size() + head_bytes + y_bytes);
  event.reserve(event.size() + 1 + CodedOutputStream::VarintSize32(bytes) + bytes);
  google::protobuf::io::StringOutputStream stream(&event);
  CodedOutputStream output(&stream);
  output.WriteTag(TagOfBytes(v1::SolveEvent::kIterateFieldNumber));
  output.WriteVarint32(bytes);
  output.WriteString(times);
  output.WriteTag(TagOfBytes(v1::Iterate::kYFieldNumber));
  output.WriteVarint32(y_bytes);
  for (const std::size_t column : columns) {
    const auto y = values.y.col(static_cast<Index>(column));
    if (all.empty()) output.WriteRaw(y.data(), n * static_cast<int>(sizeof(double)));
    for (const int row : rows) output.WriteRaw(y.data() + row, sizeof(double));
  }
}

}  // namespace dlcs
